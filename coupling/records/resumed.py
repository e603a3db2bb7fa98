"""The files of a run that goes on: what they had at the checkpoint stays, what is later goes."""
import re
import shutil
from pathlib import Path
from typing import Any, Dict, NamedTuple

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

    def files(self, results: Results, pieces: ParaView, history: str, names: Any) -> Kept:
        """Bring the files of the set to where they were, in another folder as copies. Returns what stays of
        the file ``history``; names: see ``files.Names``. On rank 0."""
        written = self.state.get("written", ())
        if results.started:
            numbered = re.compile(rf"\w+_\d{{4}}{f'_{names.label}' if names.label else ''}\.(asc|csv)")
            later = [name for name in results.files() if numbered.fullmatch(name) and name not in written]
            results.remove(*names.at_end, *pieces.later(results.files()), *later)
        else:
            for name in (history, *written, *pieces.files()):
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
