"""The files of a run that goes on: what they had at the checkpoint stays, what is later goes."""
import shutil
from pathlib import Path
from typing import Any, Dict, Iterable, NamedTuple

import numpy as np
from mpi4py import MPI

from .history import Kept
from .paraview import ParaView
from .results import Results
from .rows import Rows


class Resumed(NamedTuple):
    """From where a record goes on. state: of ``Record.get_state``; source: folder with the files so far."""

    state: Dict[str, Any]
    source: Path

    def files(self, results: Results, pieces: ParaView, history: str, last: Iterable[str]) -> Kept:
        """Bring the files of the set to where they were, in another folder as copies. Returns what stays of
        the file ``history``; last: files that are written at the end. On rank 0."""
        if results.started:
            results.remove(*last, *pieces.later(results.files()))
        else:
            for name in (history, *pieces.files()):
                shutil.copyfile(self.source / name, results.path(name))
        return Kept(self.state["rows"], self.state["size"])


def share_rows(rows: Rows, comm: MPI.Comm) -> None:
    """Give every rank the rows that rank 0 has, piece by piece. Collective."""
    parts = rows.parts() if comm.rank == 0 else None
    while True:
        part = comm.bcast(None if parts is None else next(parts, None))
        if part is None:
            return
        for row in part if comm.rank else np.empty((0, 1)):
            rows.add(row)
