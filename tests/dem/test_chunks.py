"""Where a window is cut into chunks, so that signals are heard, changes no bit of it."""
import os
import signal

import pytest

from coupling import signals
from dem_liggghts.common import chunks


def test_chunks_change_no_bit(dem, tumble, monkeypatch):
    """Contacts with friction, and lists that are made anew within a window: whole, and in chunks of 3 and 7
    steps."""
    scene, window = tumble(2)
    ends = []
    for size in (1000, 3, 7):
        monkeypatch.setattr(chunks, "SECONDS", 1e9)
        monkeypatch.setattr(chunks.Chunks, "next", lambda self, left, size=size: min(left, size))
        grains = dem(scene, 2e-5)
        forces = [grains.advance(100, *window(2e-3 * n, 2e-3)) for n in range(6)]
        ends.append(b"".join(force.tobytes() for force in forces) + grains.particles().tobytes())
    assert ends[0] == ends[1] == ends[2]


def test_chunks_follow_the_clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(chunks, "perf_counter", lambda: now[0])

    def call(begin, count):
        calls.append((begin, count))
        now[0] += count * pace
        return 0

    cut = chunks.Chunks()
    # seconds per step, faster and slower than before
    for pace, at_most in ((1e-4, 0.25), (1e-6, 0.25), (1e-3, 0.25)):
        for _ in range(3):
            calls = []
            assert cut.run(500_000, call) == 0
            assert sum(count for _, count in calls) == 500_000
            assert [begin for begin, _ in calls] == [sum(c for _, c in calls[:k]) for k in range(len(calls))]
        assert calls[-2][1] * pace <= at_most and len(calls) <= 8 + 500_000 * pace / 0.03
    assert cut.run(10, lambda begin, count: 2) == 2


def test_a_deferred_signal_lets_a_window_end(dem, tumble, monkeypatch):
    """It comes between two chunks; without ``deferred`` the window would be left there."""
    scene, window = tumble(2)
    monkeypatch.setattr(chunks.Chunks, "next", lambda self, left: min(left, 5))
    whole = dem(scene, 2e-5).advance(100, *window(0.0, 2e-3))
    done = chunks.Chunks.done

    def interrupted(self, steps, code=0):
        if signals.noted() is None:
            os.kill(os.getpid(), signal.SIGUSR1)
        return done(self, steps, code)

    monkeypatch.setattr(chunks.Chunks, "done", interrupted)
    with signals.deferred():
        force = dem(scene, 2e-5).advance(100, *window(0.0, 2e-3))
        assert signals.noted() == "SIGUSR1"
    assert force.tobytes() == whole.tobytes()
    with signals.like_interrupts(), pytest.raises(KeyboardInterrupt):
        dem(scene, 2e-5).advance(100, *window(0.0, 2e-3))
