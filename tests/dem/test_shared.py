"""Many spheres, which the ranks share: two and three of them compute what one does (built-in DEM)."""
import json

import numpy as np
import pytest

from dem_liggghts.reference.bisection import around, bisected

NEAR = 1e-10  # of the largest value
CODE = """
import json
import sys
from pathlib import Path
import crowd
what, *words = sys.argv[1:]
said = getattr(crowd, what)(*(Path(word) if "/" in word else word for word in words))
if said is not None and crowd.COMM.rank == 0:
    print(json.dumps(said))
"""
SCENES = "heap", "plane", "leaving", "rocks", "smooth", "structures"
HELD = SCENES[:3]  # in which a cluster does not give way: nobody books what it takes


@pytest.fixture
def crowd(on_ranks, tmp_path):
    """``crowd(ranks, what, *words)``: a function of `crowd.py` on so many ranks; what it writes to the last
    one of these, a file in ``tmp_path``, or returns."""
    def run(ranks, what, *words):
        paths = [tmp_path / word if word.endswith((".npz", ".h5")) else word for word in words]
        done = on_ranks(ranks, CODE, what, *paths)
        assert done.returncode == 0, done.stderr[-3000:]
        if not words[-1].endswith(".npz"):
            return json.loads(done.stdout)
        with np.load(paths[-1]) as found:
            return dict(found)

    return run


def assert_near(some, others, but=()):
    """Of each array the same to round-off, what counts or names exactly."""
    assert some.keys() == others.keys()
    for name in some.keys() - set(but):
        one, other = some[name], others[name]
        assert one.shape == other.shape, name
        if one.dtype.kind in "iub":
            assert np.array_equal(one, other), name
        else:
            np.testing.assert_allclose(other, one, rtol=0.0, atol=NEAR * np.abs(one).max(initial=0.0),
                                       err_msg=name)


@pytest.mark.mpi
@pytest.mark.parametrize("scene", SCENES)
def test_ranks_give_what_one_gives(crowd, scene):
    """Places, velocities, springs, neighbour lists, forces on the wall and all books, with several new lists
    in a window; momentum is what the books say it is."""
    one = crowd(1, "run", scene, "one.npz")
    assert len(one["built"]) > 5 and len(one["between"]) > 5
    assert one["springs"].any() != (scene == "smooth")
    assert one["wall_springs"].any() != (scene in ("rocks", "smooth"))
    assert (one["removed"][0] > 10) == (scene == "leaving")
    for ranks in (2, 3):
        shared = crowd(ranks, "run", scene, "shared.npz")
        assert_near(one, shared, ["lost"])
        assert np.abs(shared["lost"] - one["lost"]).max() < 1e-12
        assert np.abs(shared["lost"]).max() < 1e-12 or scene in HELD


@pytest.mark.mpi
def test_goes_on_from_a_file_on_any_number_of_ranks(crowd, tmp_path):
    """On as many ranks bit for bit."""
    written = crowd(2, "halves", "state.h5", "written.npz")
    assert (tmp_path / "state.h5").exists()
    for ranks in (1, 2, 3):
        read = crowd(ranks, "halves", "state.h5", "read.npz")
        assert_near(written, read)
        same = [np.array_equal(written[name], read[name]) for name in written]
        assert all(same) == (ranks == 2)


@pytest.mark.mpi
def test_another_wall_and_a_halt(crowd):
    """Contacts go on, also on discs that are numbered anew."""
    one = crowd(1, "replaced", "one.npz")
    assert one["force 10"].any() and one["wall_springs"].any()
    for ranks in (2, 3):
        assert_near(one, crowd(ranks, "replaced", "shared.npz"))


@pytest.mark.mpi
def test_only_what_touches_other_ranks_goes_there(crowd):
    """Two halves of a lattice of 4 x 4 x 4 spheres: those of one layer, nine numbers each."""
    assert crowd(2, "traffic", "smooth") == [[1.0, 16 * 9 * 8.0]] * 2


@pytest.mark.mpi
@pytest.mark.parametrize("what, text", [
    ("through", "PerforatedError: sphere 25 is going through the wall"),
    ("outside", "LeftDomain: sphere 58 has left the domain"),
    ("same place", "FloatingPointError: particle 32 is at [nan nan nan] m"),
    ("wall", "FloatingPointError: the wall given at t = 0 s contains NaN")])
def test_all_ranks_say_what_is_wrong(crowd, what, text):
    said = [crowd(ranks, "fails", what) for ranks in (1, 2, 3)]
    assert said[0].startswith(text) and said[1:] == said[:1] * 2


@pytest.mark.mpi
def test_few_spheres_stay_on_every_rank(crowd):
    """One of two ranks computes what a single one does, bit for bit, while the other one does nothing."""
    one, two = (crowd(ranks, "few", f"{ranks}.npz") for ranks in (1, 2))
    assert one["forces"].any() and all(np.array_equal(one[name], two[name]) for name in one)


@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_parts_are_alike_in_number(ranks):
    """Of points in a long box, and of those that lie in a few planes, which are not divided."""
    x = np.random.default_rng(5).uniform(size=(1000, 3)) * [10.0, 1.0, 1.0]
    counts = np.bincount(bisected(x, ranks), minlength=ranks)
    assert counts.min() >= 1000 // ranks - 2 and counts.max() <= 1000 // ranks + 3
    x[:, 0] = np.round(x[:, 0])
    rank = bisected(x[:, [0, 0, 0]], ranks)
    assert all(len(set(rank[x[:, 0] == plane])) == 1 for plane in range(11))
    assert len(set(rank)) == ranks


def test_empty_parts():
    """Points in one place cannot be divided; a rank without any is near to none."""
    x = np.zeros((5, 3))
    rank = bisected(x, 3)
    assert len(set(rank)) == 1 and len(bisected(x[:0], 3)) == 0
    assert len(around(x, rank, (rank[0] + 1) % 3, 1.0)) == 0


def test_what_is_around_a_part():
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.4, 0.0], [1.6, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    rank = np.array([0, 0, 1, 2, 0])
    assert around(x, rank, 0, 0.5).tolist() == [2] and around(x, rank, 1, 0.5).tolist() == [1, 3]
