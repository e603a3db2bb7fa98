"""The outline of a body that flows: what is divided, removed, cut and laid anew."""
import numpy as np
import pytest

from mpm_fenicsx import Body, Box, Cloud, Interface, Resampling, linear
from mpm_fenicsx.points.outline import find_change

S = 0.1  # spacing
RULE = Resampling(S)
NEVER = np.zeros(1000, bool)


def everywhere(x):
    return np.ones(len(x), bool)


def chain(x, closed=False):
    """Segments that link the places x in this order."""
    i = np.arange(len(x) - (not closed))
    return np.array(x, float), np.column_stack([i, (i + 1) % len(x)])


def circle(n, radius=0.5):
    """Clockwise: the outside is on the left."""
    t = -2 * np.pi * np.arange(n) / n
    return radius * np.column_stack([np.cos(t), np.sin(t)])


def changed(x, elements, rule=RULE, has_mass=everywhere, loaded=NEVER):
    return find_change(x, elements, rule, loaded[:len(x)], has_mass)


def length(x, elements):
    return np.linalg.norm(x[elements[:, 1]] - x[elements[:, 0]], axis=1).sum()


def area(x, elements):
    """Positive for a body with the outside on its left."""
    a, b = x[elements[:, 0]], x[elements[:, 1]]
    return -0.5 * np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def soil(**more):
    return Body(Box((0.0, 0.0), (1.0, 2.0)), (10, 20), 2, linear(1e5, 0.3), 1e3, **more)


# ------------------------------------------------------------------- around a body

def test_around_is_closed_clockwise_and_inset():
    outline = Interface.around(soil(), inset=0.1)
    assert outline.resampling.spacing == pytest.approx(0.05)
    assert outline.x.min(axis=0) == pytest.approx([0.01, 0.01]) and outline.x.max(axis=0) == pytest.approx(
        [0.99, 1.99])
    assert area(outline.x, outline.elements) == pytest.approx(0.98 * 1.98)
    assert np.linalg.norm(np.diff(outline.x, axis=0), axis=1) == pytest.approx(0.05, rel=0.03)
    assert sorted(outline.elements[:, 0]) == sorted(outline.elements[:, 1]) == list(range(len(outline.x)))


@pytest.mark.parametrize("open_sides, ends, feet", [
    (("x-", "y-"), [(0.005, 1.995), (0.995, 0.005)], (None, ("y-", 0.005))),
    (("y-",), [(0.005, 0.005), (0.995, 0.005)], (("y-", 0.005), ("y-", 0.005))),
    (("x+", "x-", "y-"), [(0.005, 1.995), (0.995, 1.995)], (None, None))])
def test_around_leaves_sides_open(open_sides, ends, feet):
    outline = Interface.around(soil(), 0.05, open_sides=open_sides, floor="y-" if any(feet) else None)
    assert outline.x[[0, -1]] == pytest.approx(np.array(ends))
    assert outline.resampling.feet == tuple(foot and (foot[0], pytest.approx(foot[1])) for foot in feet)
    assert (outline.elements == np.column_stack([np.arange(len(outline.x) - 1),
                                                 np.arange(1, len(outline.x))])).all()
    right = outline.x[outline.elements].mean(axis=1)[:, 0] > 0.99
    along = np.diff(outline.x[outline.elements], axis=1)[:, 0]
    assert (along[right, 1] < 0).all() and (along[~right, 0] >= 0).all()


@pytest.mark.parametrize("options, text",
                         [(dict(open_sides=("x-", "x+")),
                           "the open sides are x-, x\\+: the others must hang together"),
                          (dict(open_sides=("x-", "x+", "y-", "y+")), "must hang together"),
                          (dict(open_sides=("z-",)), "side of the outline is 'z-': choose one of"),
                          (dict(floor="y-"), "the floor is side 'y-'"),
                          (dict(inset=-1.0), "inset is -1.0 body cells"),
                          (dict(inset=6.0), "inset is 6.0 body cells"),
                          (dict(spacing=0.0), "spacing is 0.0 m: give a " "positive number"),
                          (dict(longest=0.4), "longest 0.4")])
def test_around_refuses(options, text):
    with pytest.raises(ValueError, match=text):
        Interface.around(soil(), **options)


def test_around_needs_a_plane_box():
    cloud = Body(Cloud([[0.0, 0.0], [1.0, 1.0]], [1.0, 1.0]), None, None, linear(1e5, 0.3), 1e3)
    with pytest.raises(ValueError, match="an outline goes around a plane body whose shape is a Box"):
        Interface.around(cloud)
    with pytest.raises(ValueError,
                       match="a foot of the outline is \\('bottom', 0.0\\): give its side, one of x-"):
        Resampling(S, feet=(None, ("bottom", 0.0)))


# ------------------------------------------------------------------- stretching

@pytest.mark.parametrize("closed", [False, True])
def test_nothing_to_do_is_no_change(closed):
    x, elements = chain(circle(30), closed)
    assert changed(x, elements) is None


@pytest.mark.parametrize("closed", [False, True])
def test_stretched_segments_are_divided_on_the_line(closed):
    x, elements = chain(circle(30) * [3.0, 1.0], closed)
    change = changed(x, elements)
    assert len(change.x) > 35 and length(change.x, change.elements) == pytest.approx(length(x, elements),
                                                                                     rel=1e-14)
    if closed:
        assert area(change.x, change.elements) == pytest.approx(area(x, elements), rel=1e-14)
    pieces = np.linalg.norm(np.diff(change.x[change.elements], axis=1)[:, 0], axis=1)
    assert pieces.max() <= 2 * S and pieces.min() > 0.25 * S
    assert change.interpolate(x) == pytest.approx(change.x, abs=1e-15)
    assert (change.x[change.successor] == x).all()  # the old ones stay where they are
    v = x @ [[1.0, 0.3], [0.2, -1.0]] + 0.7
    assert change.interpolate(v) == pytest.approx(change.x @ [[1.0, 0.3], [0.2, -1.0]] + 0.7)
    assert changed(change.x, change.elements) is None


def test_no_particle_where_there_is_no_mass():
    x, elements = chain([(0.0, 0.0), (0.1, 0.0), (0.5, 0.0), (0.9, 0.0)])
    change = changed(x, elements, has_mass=lambda at: np.abs(at[:, 0] - 0.7) > 0.15)
    assert change.x[:, 0] == pytest.approx([0.0, 0.1, 0.3, 0.5, 0.9])
    change = changed(x, elements, has_mass=lambda at: at[:, 0] < 0.55)
    assert change.x[:, 0] == pytest.approx([0.0, 0.1, 0.3, 0.5])  # the end goes, too
    lost = changed(*chain(circle(30), True), has_mass=lambda at: at[:, 0] < 0.3)
    assert lost.x[:, 0].max() < 0.3 and len(lost.elements) == len(lost.x)
    nothing = changed(*chain(circle(30), True), has_mass=lambda at: np.zeros(len(at), bool))
    assert len(nothing.x) == len(nothing.elements) == 0


# ------------------------------------------------------------------- folding

def test_short_segments_lose_the_particle_that_matters_less():
    x, elements = chain([(0.0, 0.0), (0.1, 0.0), (0.12, 0.0), (0.12, -0.1), (0.12, -0.2)])
    change = changed(x, elements)
    assert change.x == pytest.approx(x[[0, 2, 3, 4]]) and (change.successor == [0, 1, 1, 2, 3]).all()
    x[1:3, 0] = 0.02, 0.1
    assert changed(x, elements).x[0] == pytest.approx([0.0, 0.0])  # ends stay


@pytest.mark.parametrize("width", [1e-9, 0.004])
def test_folds_are_zipped_up(width):
    """A crack from above whose sides have met, down to a width of no segment."""
    depth = np.linspace(0.0, -0.5, 6)
    left, right = (np.column_stack([np.full(6, 0.3 + side * width), depth]) for side in (-0.5, 0.5))
    x, elements = chain(np.concatenate([[(0.1, 0.0), (0.2, 0.0)], left, right[-2::-1],
                                        [(0.4, 0.0), (0.5, 0.0)]]))
    change = changed(x, elements)
    assert change.x[:, 1] == pytest.approx(0.0) and (np.diff(change.x[:, 0]) > 0.02).all()
    assert change.redistribute(x) .sum(axis=0) == pytest.approx(x.sum(axis=0))


def test_loads_go_on_to_the_nearest():
    x, elements = chain(circle(60) * [0.3, 3.0], True)
    change, load = changed(x, elements), np.random.default_rng(2).normal(size=(60, 2))
    assert len(change.x) > 0 and (change.successor < len(change.x)).all()
    assert change.redistribute(load).sum(axis=0) == pytest.approx(load.sum(axis=0), abs=1e-14)
    away = np.linalg.norm(change.x[change.successor] - x, axis=1)
    assert 0 < away.max() < 0.25 * S


# ------------------------------------------------------------------- knots

def crossings(x, elements):
    """By looking at all pairs of segments."""
    a, b = x[elements[:, 0]], x[elements[:, 1]]
    cross = lambda u, w: u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]  # noqa: E731
    one = cross((b - a)[:, None], a[None] - a[:, None]) * cross((b - a)[:, None],
                                                                b[None] - a[:, None]) < -1e-15
    return int((one & one.T).sum()) // 2


def wave(overlap):
    """Surface with a breaking wave whose tip has come down by ``overlap`` into the surface in front of it."""
    back = [(0.1 * k, 0.0) for k in range(6)] + [(0.5, 0.3), (0.6, 0.55), (0.9, 0.6), (1.2, 0.5), (1.35, 0.2)]
    tip = [(1.4, -overlap), (1.25, 0.25), (1.1, 0.4), (0.9, 0.45), (0.75, 0.35), (0.7, 0.1)]
    return chain(back + tip + [(0.8 + 0.1 * k, 0.0) for k in range(12)])


def test_a_breaking_wave_encloses_air_that_is_cut_off():
    x, elements = wave(0.05)
    assert crossings(x, elements) == 2
    change = changed(x, elements)
    assert crossings(change.x, change.elements) == 0
    assert len(change.elements) == len(change.x) - 1  # one open chain
    assert change.x[[0, -1]] == pytest.approx(x[[0, -1]])
    assert not ((np.abs(change.x - [0.9, 0.45]) < 0.06).all(axis=1)).any()  # the lower side of the wave
    assert ((np.abs(change.x - [0.9, 0.6]) < 1e-9).all(axis=1)).any()
    assert changed(*wave(-0.05)).x.shape[0] >= len(x) - 2  # it has not touched yet


def drop(half_neck):
    """Surface with a drop on a neck; where this is negative, its sides have crossed."""
    t = np.radians(np.linspace(240, -60, 31))
    ball = np.column_stack([0.5 * np.cos(t), 1.2 + 0.5 * np.sin(t)])
    foot = [(-1.0, 0.0), (-0.85, 0.0), (-0.7, 0.0), (-0.55, 0.0), (-0.4, 0.0), (-0.3, 0.1), (-0.2, 0.2),
            (-0.1, 0.4), (-half_neck, 0.5), (-half_neck, 0.6)]
    return chain(np.concatenate([foot, ball, (foot * np.array([-1.0, 1.0]))[::-1]]))


def test_a_drop_that_pinches_off_keeps_an_outline():
    """Both drop and rest have the outside on the left; when they meet again they become one."""
    long = Resampling(S, 4.0)
    assert changed(*drop(0.05), long) is None
    x, elements = drop(-0.02)
    change = changed(x, elements, long)
    assert crossings(x, elements) == 2 and crossings(change.x, change.elements) == 0
    assert len(change.x) - len(change.elements) == 1  # one open chain and
    ends = np.flatnonzero(~np.isin(np.arange(len(change.x)), change.elements[:, 0]))
    closed = change.elements[change.elements[:, 0] > ends[0]]
    assert 25 < len(closed) <= 33 and area(change.x, closed) == pytest.approx(0.25 * np.pi, rel=0.1)
    x = change.x.copy()
    x[closed[:, 0], 1] -= 0.45
    assert crossings(x, change.elements) == 2
    merged = changed(x, change.elements, long)
    assert crossings(merged.x, merged.elements) == 0
    ends = np.flatnonzero(~np.isin(np.arange(len(merged.x)), merged.elements[:, 0]))
    assert (ends == [len(merged.x) - 1]).all() and merged.x[:, 1].max() == pytest.approx(1.25, abs=0.01)


def test_knots_in_a_closed_outline_go():
    x, elements = chain(circle(40, 1.0), True)
    x[[10, 11]] = x[[11, 10]]
    assert crossings(x, elements) == 1
    change = changed(x, elements)
    assert crossings(change.x, change.elements) == 0 and len(change.x) >= 37
    assert area(change.x, change.elements) == pytest.approx(np.pi, rel=0.03)


# ------------------------------------------------------------------- the foot

FOOT = Resampling(S, longest=6.0, feet=(None, ("y-", 0.01)), reach=4.0)


def front(*toe):
    """Upper side down to the right, the toe, and the foot at x = 1."""
    return chain([(0.0, 1.0), (0.2, 0.9), (0.4, 0.8), (0.6, 0.75), (0.8, 0.7), (1.0, 0.6), (1.15, 0.5), *toe,
                  (1.0, 0.01)])


def test_foot_goes_beneath_the_nose_and_what_was_overrun_is_cut():
    x, elements = front((1.2, 0.35), (1.25, 0.25), (1.2, 0.15), (1.1, 0.1))
    change = changed(x, elements, FOOT)
    nose = int(np.flatnonzero((change.x == (1.25, 0.25)).all(axis=1))[0])
    assert change.x[-1] == pytest.approx([1.25, 0.01]) and change.x[:, 0].max() == 1.25
    assert not (np.abs(change.x - [1.1, 0.1]) < 1e-9).all(axis=1).any()
    v = np.random.default_rng(1).normal(size=x.shape)
    assert change.interpolate(v)[-1] == pytest.approx(v[8]) and change.interpolate(v)[nose] == pytest.approx(
        v[8])
    assert changed(change.x, change.elements, FOOT) is None


def test_foot_does_not_go_back_nor_through_a_load():
    x, elements = front((1.2, 0.35), (1.25, 0.25), (1.2, 0.15), (1.1, 0.1))
    x[-1, 0] = 1.3
    assert changed(x, elements, FOOT) is None
    x[-1, 0] = 1.0
    loaded = np.zeros(len(x), bool)
    loaded[9] = True  # something stands under the nose
    assert changed(x, elements, FOOT, loaded=loaded).x[-1] == pytest.approx([1.1, 0.01])
    loaded[-1] = True
    assert changed(x, elements, FOOT, loaded=loaded) is None
    assert changed(x, elements, FOOT, has_mass=lambda at: (at[:, 0] < 1.2) | (at[:, 1] > 0.2)).x[-1] == \
        pytest.approx(x[-1])  # no mass beneath the nose


def test_foot_at_the_first_end_and_on_other_sides():
    x, elements = front((1.2, 0.35), (1.25, 0.25), (1.2, 0.15), (1.1, 0.1))
    expected = changed(x, elements, FOOT).x
    mirrored = np.array(x[::-1] * [-1.0, 1.0])
    found = changed(mirrored, elements, Resampling(S, 6.0, feet=(("y-", 0.01), None))).x
    assert found == pytest.approx(expected[::-1] * [-1.0, 1.0])
    turned = x @ [[0.0, 1.0], [-1.0, 0.0]]  # by 90 degrees: down is to the right
    found = changed(turned, elements, Resampling(S, 6.0, feet=(None, ("x+", -0.01)))).x
    assert found == pytest.approx(expected @ [[0.0, 1.0], [-1.0, 0.0]])
