"""When checkpoints are due, and when a run stops before its walltime is over; with a clock that is set by
hand."""
import os
import signal
from types import SimpleNamespace

import pytest

from coupling import signals
from coupling.durations import Every
from coupling.records.schedule import Due, Schedule

SEVERAL = """
import os, signal
from mpi4py import MPI
from coupling import signals
from coupling.durations import Every
from coupling.records.schedule import Schedule

rank = MPI.COMM_WORLD.rank
now = [0.0]
with signals.deferred():
    said = []
    schedule = Schedule(Every(seconds=10.0), 1000.0, 0.0, clock=lambda: now[0])
    for number in range(1, 6):
        now[0] += (4.0, 900.0)[rank]  # the clocks of other ranks are not asked
        if (number, rank) == (5, 1):
            os.kill(os.getpid(), signal.SIGUSR1)
        due = schedule(number)
        said.append(tuple(due))
        if due.checkpoint:
            schedule.wrote(1.0)
print(f"rank {rank}: {said}\\n", end="", flush=True)
"""


@pytest.fixture
def clock():
    """Call it for the moment [s], set ``now``."""
    class Clock(SimpleNamespace):
        def __call__(self):
            return self.now

    return Clock(now=100.0)


def run(schedule, clock, lengths, took=1.0):
    """Numbers of the windows of these lengths [s] after which a checkpoint is written, until a stop; why."""
    written = []
    for number, length in enumerate(lengths, 1):
        clock.now += length
        due = schedule(number)
        if due.checkpoint:
            written.append(number)
            clock.now += took
            schedule.wrote(took)
        if due.stop:
            return written, due.stop
    return written, None


def test_nothing_is_due_where_nothing_is_asked_for():
    schedule = Schedule(None, None, clock=iter([0.0]).__next__)  # the clock is not even asked
    assert schedule(1) == Due(False, None)


def test_a_checkpoint_after_so_many_windows(clock):
    assert run(Schedule(Every(windows=3), None, clock=clock), clock, [1.0] * 10) == ([3, 6, 9], None)


def test_a_checkpoint_after_so_much_run_time(clock):
    """The time counts from the end of the last one, however long that took, and from the first window."""
    schedule = Schedule(Every(seconds=10.0), None, clock=clock)
    clock.now += 50.0
    schedule.begin()
    assert run(schedule, clock, [4.0] * 9, took=9.0) == ([3, 6, 9], None)


def test_only_at_the_end(clock):
    assert run(Schedule(Every(), None, clock=clock), clock, [1e6] * 3) == ([], None)


@pytest.mark.parametrize("walltime, took", [(100.0, 1.0), (100.0, 10.0), (5000.0, 1.0)])
def test_a_run_stops_before_its_walltime_is_over(clock, walltime, took):
    """What is left, counted from the start of the process, holds a window, a checkpoint and the end, each
    with the allowance that is promised."""
    schedule = Schedule(Every(windows=1), walltime, clock.now, clock=clock)
    written, why = run(schedule, clock, [1.0] * 10000, took)
    assert why == ("walltime of 1min40s" if walltime == 100.0 else "walltime of 1h23min20s")
    used, end = clock.now - took - 100.0, max(5.0, 0.01 * walltime)  # at the moment of the decision
    need = 2.0 * 1.0 + max(2.0 * took, 1.0) + end
    assert walltime - used < need <= walltime - used + 1.0 + took, (used, need)
    assert written[-1] == len(written)


def test_before_the_first_checkpoint_it_gets_as_much_as_the_end(clock):
    written, why = run(Schedule(None, 3600.0, clock.now, clock=clock), clock, [1.0] * 3600)
    assert why == "walltime of 1h" and written == [3600 - 2 * 36 - 2 + 1]


def test_the_longest_of_the_recent_windows_counts(clock):
    """But not one from long ago: that would end this run after 580 s of its 1000 s."""
    slow_first = Schedule(None, 1000.0, clock.now, clock=clock)
    assert run(slow_first, clock, [200.0] + [1.0] * 1000) == ([780], "walltime of 16min40s")
    slow_last = Schedule(None, 1000.0, clock.now, clock=clock)
    assert run(slow_last, clock, [1.0] * 400 + [200.0] + [1.0] * 9) == ([401], "walltime of 16min40s")


def test_the_time_of_a_checkpoint_is_no_part_of_a_window(clock):
    schedule = Schedule(Every(windows=1), 1000.0, clock.now, clock=clock)
    assert run(schedule, clock, [1.0], took=400.0) == ([1], None)
    schedule.wrote(1.0)  # a quick one
    assert run(schedule, clock, [1.0]) == ([1], None)  # else 800 s would be needed


def test_a_noted_signal_stops_the_run_once_its_window_is_done(clock):
    schedule = Schedule(Every(), None, clock=clock)
    with signals.deferred():
        assert schedule(1) == Due(False, None)
        os.kill(os.getpid(), signal.SIGUSR1)
        assert schedule(2) == Due(True, "signal SIGUSR1")
    assert schedule(3) == Due(False, None)


@pytest.mark.mpi
def test_all_ranks_decide_alike(run_ranks, tmp_path):
    """By the clock of rank 0, and for a signal that only rank 1 gets."""
    (tmp_path / "ranks.py").write_text(SEVERAL)
    done = run_ranks(2, tmp_path / "ranks.py", timeout=60)
    assert done.returncode == 0, done.stderr  # which may hold a line of MPI's own about the network
    nothing, write, stop = (False, None), (True, None), (True, "signal SIGUSR1")
    said = [nothing, nothing, write, nothing, stop]
    assert sorted(done.stdout.splitlines()) == [f"rank {rank}: {said}" for rank in range(2)]
