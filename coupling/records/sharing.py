"""Work that may fail on one rank alone: its error is raised on all of them, so that none waits for
another."""
from typing import Any, Callable, Optional

from mpi4py import MPI


def on_first(comm: MPI.Comm, work: Callable[[], Any]) -> Any:
    """The result of ``work()`` on rank 0, on all ranks; so is an OSError of it. Collective."""
    result = problem = None
    if comm.rank == 0:
        try:
            result = work()
        except OSError as error:
            problem = error
    if comm.size > 1:
        result, problem = comm.bcast((result, problem))
    if problem is not None:
        raise problem
    return result


def on_each(comm: MPI.Comm, work: Callable[[], None]) -> None:
    """``work()`` on every rank; the OSError of the lowest rank that has one is raised on all. Collective."""
    problem: Optional[OSError] = None
    try:
        work()
    except OSError as error:
        problem = error
    problems = [problem] if comm.size == 1 else comm.allgather(problem)
    for problem in problems:
        if problem is not None:
            raise problem
