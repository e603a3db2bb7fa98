"""Checkpoints of a run by the Python interface, on a full disk, and of what may change at a restart."""
import os

import numpy as np
import pytest

from coupling import Output, Run, Scheme, checkpoint
from dem_liggghts import Material, Scene, Spheres, Wall, open_dem
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear

RUBBER, SCHEME = Material(E=1e7, nu=0.3), Scheme(dt=1e-4, t_end=5e-3, substeps=10)


def block():
    box = Box((0.0, 0.0), (0.1, 0.1))
    body = Body(box, (4, 4), 2, linear(E=1e7, nu=0.3), rho=1000.0)
    bottom = Support(lambda x: x[:, 1] < 1e-9, "xy")
    return MPM(Grid(Box((-0.05, 0.0), (0.15, 0.2)), (8, 8)), body, [bottom], Interface.top(box, (4,)))


def ball_on_block(out, *observers, **more):
    """A ``Run`` of 50 windows."""
    solid = block()
    ball = Spheres([[0.05, 0.111]], [[0.0, -1.0]], 0.01, 2500.0)
    scene = Scene(ball, Wall(solid.interface.x, solid.interface.elements), RUBBER, RUBBER)
    return Run("ball", solid, scene, SCHEME, Output(out, **more), observe=lambda *sides: list(observers),
               columns={"v": ("m/s", "of the ball", lambda w: w.particles["v"][0, 1])})


class Saving:
    """Observer that saves the run after window ``number``, and counts what it has seen."""

    def __init__(self, path, number):
        self.path, self.number, self.run, self.seen = path, number, None, 0

    def __call__(self, window):
        self.seen += 1
        if window.number == self.number:
            self.run.save(self.path)

    def get_state(self):
        return self.seen

    def set_state(self, state):
        self.seen = state


def test_a_run_is_saved_and_loaded(tmp_path):
    """By an observer."""
    saving = Saving(tmp_path / "saved.h5", 21)
    run = saving.run = ball_on_block(tmp_path / "out", saving)
    straight = run.go()["reference"]["v"]
    with pytest.raises(RuntimeError, match="the run ball is not on its way: save it from an observer, or ask "
                       "for a checkpoint at its end"):
        run.save(tmp_path / "late.h5")
    again = Saving(tmp_path / "no.h5", 0)
    loaded = ball_on_block(tmp_path / "out", again).load(tmp_path / "saved.h5")
    assert loaded.output.restart == tmp_path / "saved.h5"
    history = loaded.go()["reference"]
    assert np.array_equal(history["v"], straight) and again.seen == 50
    assert checkpoint.find(tmp_path / "saved.h5").head["window"] == 21


def test_each_side_alone_goes_on_from_the_checkpoint_of_a_run(tmp_path, backend):
    run = ball_on_block(tmp_path, checkpoint="end")
    run.go()
    solid, path = block(), tmp_path / "checkpoint.h5"
    solid.load(path)
    assert solid.time == pytest.approx(5e-3) and np.array_equal(solid.points.x, run.solid.points.x)
    grains = open_dem(backend, run.grains, SCHEME.inner)
    if backend == "reference":
        grains.load(path)
        assert grains.time == pytest.approx(5e-3) and grains.particles()["v"][0, 1] > 0.5
    else:
        with pytest.raises(ValueError, match="give one that this back end has made"):
            grains.load(path)
    grains.close()


def test_another_scene_is_refused(tmp_path):
    ball_on_block(tmp_path, checkpoint="end").go()
    for change, words in (({"name": "other"}, "is of ball, this is other: give a checkpoint of this case"),
                          ({"scheme": Scheme(1e-4, t_end=5e-3, substeps=20)}, "substeps=20 contradicts the "),
                          ({"grains": None, "scheme": SCHEME}, "is of a run with grains: restart it with")):
        other = ball_on_block(tmp_path, restart=tmp_path)
        with pytest.raises(ValueError, match=words):
            Run(**{**{name: getattr(other, name) for name in ("name", "solid", "grains", "scheme", "output")},
                   **change}).go()


@pytest.fixture
def small_disk(disk):
    """A folder on a disk of 2 MB."""
    return disk("2m") / "out"


def test_a_full_disk_leaves_the_older_checkpoint(small_disk):
    """The run goes on, with one warning; when there is room again it writes the next ones."""
    filler, seen = small_disk.parent / "filler", {}

    def fill(window):
        if window.number == 20:
            free = os.statvfs(filler.parent)
            filler.write_bytes(bytes(max(free.f_bavail * free.f_bsize - 40_000, 0)))
        if window.number in (33, 40):
            seen[window.number] = checkpoint.find(small_disk).head["window"]
        if window.number == 40:
            filler.unlink()

    with pytest.warns(UserWarning, match="no checkpoint could be written after window 21 .*No space left.*"
                      "the last one is of window 14: the run goes on") as told:
        ball_on_block(small_disk, fill, checkpoint=7).go()
    assert seen == {33: 14, 40: 14} and checkpoint.find(small_disk).head["window"] == 50
    assert sum("no checkpoint could be" in str(warning.message) for warning in told) == 1
    assert {path.name for path in small_disk.iterdir()} == {
        "checkpoint.h5", "checkpoint_before.h5", "history.csv", "manifest.txt", "report.json"}


def test_only_two_checkpoints_are_kept_and_files_stay_closed(tmp_path):
    handles = []
    count = lambda window: handles.append(len(os.listdir("/proc/self/fd")))
    ball_on_block(tmp_path, count, checkpoint=1).go()
    assert len(set(handles[5:])) == 1
    assert sorted(path.name for path in tmp_path.glob("*.h5*")) == ["checkpoint.h5", "checkpoint_before.h5"]
    assert [checkpoint.find(tmp_path / name).head["window"] for name in ("checkpoint.h5",
                                                                         "checkpoint_before.h5")] == [50, 49]


def test_what_is_no_length_of_time_is_refused():
    with pytest.raises(ValueError, match="checkpoint is .*10 minutes.*: give a number of windows such as"):
        Output("out", checkpoint="10 minutes")
    with pytest.raises(ValueError, match="walltime is '100': give it with a unit, such as 100s"):
        Output("out", walltime="100")
