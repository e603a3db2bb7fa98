"""What the scenes share: how the basis is stated, and a march that keeps what it sees."""
import io
import json
import tempfile
import time
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, Callable, NamedTuple
from unittest.mock import patch

import numpy as np
from mpi4py import MPI

from mpm_fenicsx import MPM, Numerics


class March(NamedTuple):
    """Steps taken: ``rows``, what was seen after each, shape (steps, …); Newton iterations per step, their
    mean; this process' time in a step [ms], the median, and in all steps at that pace [s]."""

    rows: np.ndarray
    newton: float
    step_ms: float
    seconds: float

    @property
    def cost(self) -> dict:
        """As entries of what a scene returns."""
        return {"newton": self.newton, "step_ms": self.step_ms, "seconds": self.seconds}


def numerics(basis: str = "linear", **others: str) -> Numerics:
    """``Numerics`` with this ``basis``; others: further fields, such as ``transfer``."""
    return Numerics(basis=basis, **others)  # type: ignore[arg-type]


def march(solid: MPM, dt: float, steps: int, look: Callable[[MPM], object]) -> March:
    """Advance ``solid`` by ``steps`` of ``dt`` [s]; look: what to keep after each, a number or an array,
    collective. The median ignores the step in which kernels are compiled."""
    rows, iterations, lengths = [], 0, []
    for _ in range(steps):
        began = time.process_time()  # what else the machine does should not count
        solid.advance(dt)
        lengths.append(time.process_time() - began)
        iterations += solid.iterations
        rows.append(np.array(look(solid), float))
    step = float(np.median(lengths))
    return March(np.array(rows), iterations / steps, 1e3 * step, step * steps)


def gather(solid: MPM, values: np.ndarray) -> np.ndarray:
    """``values`` of this rank's points, shape (n, …), of all ranks in the order of the points' numbers."""
    gid = np.concatenate([body.points.gid for body in solid.bodies])
    everyone = solid.comm.allgather((gid, values))
    order = np.argsort(np.concatenate([part for part, _ in everyone]))
    return np.concatenate([part for _, part in everyone])[order]


def of_case(main: Callable, **keys: Any) -> dict:
    """Run a case, silently, in a folder that is removed afterwards: the errors of its report, and what the
    steps of its solid cost, as of ``March``. Collective."""
    comm, attempt, lengths = MPI.COMM_WORLD, MPM.attempt, []

    def clocked(solid: MPM, *given: Any) -> Any:
        began = time.process_time()
        try:
            return attempt(solid, *given)
        finally:
            lengths.append(time.process_time() - began)

    with tempfile.TemporaryDirectory() as own, redirect_stdout(io.StringIO()):
        folder = comm.bcast(own)
        with patch.object(MPM, "attempt", clocked):
            main(out=folder, **keys)
        path = Path(folder) / "report.json"
        report = comm.bcast(json.loads(path.read_text()) if comm.rank == 0 else None)
        comm.barrier()
    step = float(np.median(lengths))
    return {**report["errors"], "newton": report["newton_mean"], "step_ms": 1e3 * step,
            "seconds": step * len(lengths)}
