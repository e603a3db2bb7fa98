"""Maps between interface and wall: copies, sums, work, linear fields."""
import numpy as np
import pytest

from coupling import linear, nearest

RUN = """
import sys
import numpy as np
from mpi4py import MPI
from coupling import linear, nearest, spread
line = lambda n: np.column_stack([np.linspace(-1, 1, n + 1), np.zeros(n + 1)])
elements = lambda n: np.column_stack([np.arange(n), np.arange(1, n + 1)])
rng, out = np.random.default_rng(0), {}
for n, m in ((40, 331), (331, 40), (1, 1), (2, 300)):
    x, wall = line(n), line(m)
    plain = linear(x, elements(n), wall)
    maps = {"nearest": nearest(x, wall), "linear": plain, "spread": spread(plain, 0.2, 1e-3)}
    for name, mapping in maps.items():
        assert mapping.is_copy == (n == m and name != "spread")
        moved = mapping.motion(x + rng.normal(size=x.shape), rng.normal(size=x.shape))
        force = mapping.force(rng.normal(size=wall.shape))
        if name == "spread":
            out[f"dent {n} {m}"] = mapping.indentation(rng.normal(size=wall.shape))
        for key, values in ("x", moved[0]), ("v", moved[1]), ("force", force):
            assert len(set(MPI.COMM_WORLD.allgather(values.tobytes()))) == 1
            out[f"{name} {n} {m} {key}"] = values
if MPI.COMM_WORLD.rank == 0:
    np.savez(sys.argv[1], **out)
"""


def line(n, height=0.0):
    """n + 1 places along [-1, 1] and the segments between them."""
    x = np.linspace(-1, 1, n + 1)
    return np.column_stack([x, np.full(n + 1, height)]), np.column_stack([np.arange(n), np.arange(1, n + 1)])


def maps(n_solid, n_wall):
    x, elements = line(n_solid)
    wall, _ = line(n_wall)
    return {"nearest": nearest(x, wall), "linear": linear(x, elements, wall)}


@pytest.mark.parametrize("kind", ["nearest", "linear"])
def test_same_places_make_a_copy(kind):
    mapping = maps(7, 7)[kind]
    x, v = np.random.default_rng(0).normal(size=(2, 8, 2))
    assert mapping.is_copy
    assert mapping.motion(x, v)[0] is x and mapping.motion(x, v)[1] is v and mapping.force(x) is x


@pytest.mark.parametrize("kind", ["nearest", "linear"])
def test_places_in_another_order_are_no_copy(kind):
    (x, elements), order = line(7), [3, 1, 0, 2, 7, 6, 5, 4]
    mapping = nearest(x, x[order]) if kind == "nearest" else linear(x, elements, x[order])
    u, v = np.random.default_rng(0).normal(size=(2, 8, 2))
    assert not mapping.is_copy
    moved, speed = mapping.motion(x + u, v)
    assert moved == pytest.approx((x + u)[order], rel=1e-15) and (speed == v[order]).all()
    assert mapping.force(v[order]) == pytest.approx(v)


@pytest.mark.parametrize("kind", ["nearest", "linear"])
@pytest.mark.parametrize("sizes", [(6, 10), (10, 6), (5, 17)])
def test_sums_and_work_are_kept(kind, sizes):
    """A rigid motion arrives as it is, forces keep their sum, and both sides see the same power."""
    mapping, rng = maps(*sizes)[kind], np.random.default_rng(1)
    x, _ = line(sizes[0])
    wall, _ = line(sizes[1])
    moved, speed = mapping.motion(x + (0.1, 0.2), np.tile((3.0, 4.0), (len(x), 1)))
    assert moved == pytest.approx(wall + (0.1, 0.2)) and speed == pytest.approx(np.tile((3.0, 4.0),
                                                                                        (len(wall), 1)))
    force, v = rng.normal(size=wall.shape), rng.normal(size=x.shape)
    assert mapping.force(force).sum(axis=0) == pytest.approx(force.sum(axis=0), abs=1e-14)
    assert np.vdot(mapping.force(force), v) == pytest.approx(np.vdot(force, mapping.motion(x, v)[1]),
                                                             abs=1e-13)


def test_linear_reproduces_linear_fields_and_keeps_their_moment():
    x, elements = line(6)
    wall, _ = line(17, height=1e-3)  # not on the segments, but close
    mapping = linear(x, elements, wall)
    field = lambda at: np.column_stack([1 + 2 * at[:, 0], 3 - at[:, 0]])  # noqa: E731
    assert mapping.motion(x, field(x))[1] == pytest.approx(field(wall), abs=1e-14)
    force = np.random.default_rng(2).normal(size=wall.shape)
    assert x[:, 0] @ mapping.force(force)[:, 1] == pytest.approx(wall[:, 0] @ force[:, 1], abs=1e-14)


def test_nearest_takes_the_nearest():
    x, _ = line(2)
    mapping = nearest(x, np.array([[-0.6, 0], [-0.4, 0.0], [0.9, 0.3]]))
    v = np.array([[1.0, 0], [2.0, 0], [3.0, 0]])
    assert (mapping.motion(x, v)[1][:, 0] == [1, 2, 3]).all()


def test_beyond_the_ends_the_end_counts():
    x, elements = line(2)
    v = np.array([[1.0, 0], [2.0, 0], [3.0, 0]])
    assert (linear(x, elements, [[-1.5, 0.1], [1.5, 0.1]]).motion(x, v)[1][:, 0] == [1, 3]).all()


def triangles(n, seed=None):
    """A square [-1, 1]^2 of 2 n^2 triangles in space, on a slope, and perhaps shaken within its plane."""
    s, t = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-1, 1, n + 1)], indexing="ij"))
    inner = (abs(s) < 1) & (abs(t) < 1)
    shake = np.zeros((2, len(s))) if seed is None else np.random.default_rng(seed).uniform(-0.3, 0.3,
                                                                                           (2, len(s))) / n
    s, t = s + shake[0] * inner, t + shake[1] * inner
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return (np.column_stack([s, 0.5 * s + 0.2 * t, t]),
            np.concatenate([np.column_stack([a, a + 1, a + n + 2]),
                            np.column_stack([a, a + n + 2, a + n + 1])]))


def test_linear_on_triangles_reproduces_linear_fields_and_keeps_sum_and_moment():
    x, elements = triangles(4, seed=1)
    wall = triangles(7, seed=2)[0]
    mapping = linear(x, elements, wall + 0.01 * np.array([-0.5, 1.0, -0.2]))  # beside it, along the normal
    field = lambda p: p @ [[1.0, 2.0, 0.5], [0.0, -1.0, 3.0], [0.3, 0.1, 1.0]]  # noqa: E731
    assert mapping.motion(x, field(x))[1] == pytest.approx(field(wall), abs=1e-12)
    force = np.random.default_rng(3).normal(size=wall.shape)
    back = mapping.force(force)
    assert back.sum(axis=0) == pytest.approx(force.sum(axis=0))
    assert np.cross(x, back).sum(axis=0) == pytest.approx(np.cross(wall, force).sum(axis=0))
    assert linear(x, elements, x).is_copy


def test_beyond_a_triangle_its_closest_point_counts():
    x, elements = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]]), [[0, 1, 2]]
    wall = [[0.5, 1.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.2, -1.0], [0.0, 0.0, 3.0]]
    found = linear(x, elements, wall).force(np.eye(len(wall))).T
    assert found == pytest.approx(np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [1, 0, 0], [0, 0, 1]]))


def test_triangle_without_area_is_refused():
    with pytest.raises(ValueError, match="interface triangle 1 has no area: remove it"):
        linear([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [2, 0, 0]], [[0, 2, 1], [0, 1, 3]], [[0.0, 0, 0]])


def test_segment_without_length_is_refused():
    with pytest.raises(ValueError, match="interface segment 1 has no length"):
        linear([[0, 0], [1, 0], [1, 0]], [[0, 1], [1, 2]], [[0.5, 0]])


@pytest.mark.mpi
def test_three_ranks_give_the_bits_of_one(on_ranks, tmp_path):
    """Forces of up to 150 wall nodes meet at one interface point; with two or more of them per rank the order
    of the sum would show. A mapping of two nodes leaves one of the ranks without a row."""
    answers = []
    for ranks in (1, 3):
        done = on_ranks(ranks, RUN, tmp_path / f"{ranks}.npz")
        assert done.returncode == 0, done.stderr
        answers.append(np.load(tmp_path / f"{ranks}.npz"))
    one, three = answers
    assert len(one.files) == 40
    for name in one.files:
        assert np.array_equal(one[name], three[name]), name
