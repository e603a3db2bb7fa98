"""Loads on boundary particles that follow the body."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, Box, Interface, Load
from mpm_fenicsx.points import surface

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def around(pieces=4, inset=0.02):
    """The sides of a square of 1 m, clockwise: the outside is on the left."""
    corners = SQUARE[::-1] * (1 - 2 * inset)
    s = np.arange(pieces)[:, None] / pieces
    x = np.concatenate([a + s * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0))])
    i = np.arange(len(x))
    return Interface(x, np.column_stack([i, np.roll(i, -1)]))


def square(make_mpm, loads, h=0.25, **others):
    others = {"law": LAWS["linear"](1e4, 0.3), "margin": 3, **others}
    return make_mpm(box=(SQUARE[0], SQUARE[2]), h=h, interface=None, loads=loads, **others)


def test_areas_of_a_closed_surface_add_up():
    """A box of 1 m x 2 m x 3 m of six patches, and the square: outwards, and nothing in sum."""
    o, size = np.zeros(3), np.diag([1.0, 2.0, 3.0])
    total, area = np.zeros(3), 0.0
    for k in range(3):
        first, second = size[(k + 1) % 3], size[(k + 2) % 3]
        for patch in (Interface.patch(size[k], first, second, (2, 3)), Interface.patch(o, second, first,
                                                                                       (1, 4))):
            normal = surface.normal_areas(patch.x, patch.elements)
            away = np.sign(patch.x.mean(axis=0)[k] - size[k, k] / 2)
            assert (normal[:, k] * away > 0).all()
            total += normal.sum(axis=0)
            area += surface.areas(patch.x, patch.elements).sum()
    np.testing.assert_allclose(total, 0.0, atol=1e-14)
    assert area == pytest.approx(22.0)
    ring = around(inset=0.0)
    normal = surface.normal_areas(ring.x, ring.elements)
    assert (np.sum(normal * ring.x[ring.elements].mean(axis=1), axis=1) > 0).all()
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(4.0)


def test_a_force_is_the_same_as_one_on_the_interface(make_mpm, cell):
    """Bit for bit, as the same particles carry it in the same way; and in the middle of the step."""
    top = Interface.top(Box((0.0, 0.0), (2.0, 1.0)), 4, 0.1)
    push = lambda t: np.outer(np.linspace(1, 2, 5), [np.sin(10 * t), -1.0])  # noqa: E731
    loaded = make_mpm(cell, interface=None, loads=[Load(top, force=push)])
    pushed = make_mpm(cell, interface=top)
    for n in range(6):
        loaded.advance(0.02)
        pushed.advance(0.02, push((n + 0.5) * 0.02))
    np.testing.assert_allclose(loaded.points.x, pushed.points.x, rtol=0, atol=1e-15)
    np.testing.assert_allclose(loaded.loads[0].points.x, pushed.boundary.x, rtol=0, atol=1e-15)


def test_traction_is_the_nodal_load_of_its_area(make_mpm):
    """On a body of 0.7 m thickness that hardly deforms: half a segment for the particles at the ends. The
    difference is the change of the area, about 1e-5."""
    top, share = Interface.top(Box((0.0, 0.0), (2.0, 1.0)), 4, 0.1), np.array([0.5, 1, 1, 1, 0.5]) * 0.5 * 0.7
    drag, stiff = np.array([1.0, -3.0]), dict(law=LAWS["linear"](1e6, 0.3), thickness=0.7)
    loaded = make_mpm(interface=None, loads=[Load(top, traction=drag)], **stiff)
    pushed = make_mpm(interface=top, **stiff)
    for _ in range(10):
        loaded.advance(0.02)
        pushed.advance(0.02, np.outer(share, drag))
    F = pushed.points.F
    change = abs(F.transpose(0, 2, 1) @ F - np.eye(2)).max()
    assert change < 1e-5
    np.testing.assert_allclose(loaded.points.x, pushed.points.x, rtol=0, atol=change)
    np.testing.assert_allclose(loaded.loads[0].points.force, np.outer(share, drag), rtol=10 * change)


def test_traction_and_pressure_follow_the_surface(make_mpm):
    """Particles moved by hand: traction keeps its direction and grows with the area, pressure turns with the
    normal."""
    line = Interface.line((-0.4, 0.4), (0.4, 0.4), 8)
    solid = square(make_mpm, [Load(line, traction=(2.0, 0.0)), Load(line, pressure=5.0)], thickness=0.5)
    loads, c, s = solid.loads[0], np.cos(0.3), np.sin(0.3)
    loads.points.x[:] = 1.5 * loads.points.x @ np.array([[c, s], [-s, c]])
    force = loads.at(solid.comm, 5e-4, 0.0)
    np.testing.assert_allclose(force[:9].sum(axis=0), [2.0 * 1.2 * 0.5, 0.0], atol=1e-14)
    np.testing.assert_allclose(force[9:].sum(axis=0), 5.0 * 1.2 * 0.5 * np.array([s, -c]), rtol=1e-13)


def test_pressure_all_around_moves_nothing_but_compresses(make_mpm):
    """Resultant and moment of a uniform pressure on a closed surface vanish however it turns, and the mean
    stress becomes -p (measured: 1.6 % less)."""
    press = Load(around(8, 0.0001), pressure=lambda t: 100 * np.sin(np.pi / 2 * min(t, 1.0))**2)
    solid = square(make_mpm, [press], law=LAWS["neo_hooke"](1e4, 0.3), inertia="lumped",
                   velocity=lambda x: 0.3 * np.column_stack([-x[:, 1], x[:, 0]]))
    for _ in range(120):
        solid.advance(0.01)
    x = solid.loads[0].points.x
    force = solid.loads[0].at(solid.comm, solid.time, 0.0)  # where the particles are now
    assert abs(force).max() > 10 and abs(force.sum(axis=0)).max() < 1e-12
    assert abs(np.sum(x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0])) < 1e-12
    assert abs(solid.momentum()).max() < 1e-12
    np.testing.assert_allclose(solid.cauchy_stress().mean(axis=0), -100 * np.eye(2), atol=2.0)


def test_pressure_turns_with_a_block(make_mpm):
    """On one side of a block that turns: the force of each step is that of the surface half-way, p L (sin,
    -cos) of its angle, to 0.4 % in steps of 0.05 rad (the surface at the start of the step would be wrong by
    2.5 %), 0.1 % and
    0.06 % in smaller ones; the block takes up its impulse."""
    line = Interface.line((-0.5, 0.4999), (0.5, 0.4999), 8)

    def error(steps):
        solid = square(make_mpm, [Load(line, pressure=1e-3)], cell="triangle", margin=2,
                       law=LAWS["neo_hooke"](1e3, 0.3),
                       velocity=lambda x: np.column_stack([-x[:, 1], x[:, 0]]))
        p, given, wrong = solid.loads[0].points, np.zeros(2), 0.0
        for _ in range(steps):
            before = p.x.copy()
            solid.advance(0.5 / steps)
            along = 0.5 * ((before + p.x)[-1] - (before + p.x)[0])
            wrong = max(wrong, np.linalg.norm(p.force.sum(axis=0) / 1e-3 - [along[1], -along[0]]))
            given += 0.5 / steps * p.force.sum(axis=0)
        np.testing.assert_allclose(solid.momentum(), given, atol=1e-9)
        assert p.force.sum(axis=0)[0] > 0.3e-3  # it did turn
        return wrong
    errors = np.array([error(steps) for steps in (10, 20, 40)])
    assert errors[0] < 0.005 and (errors[1:] < 0.6 * errors[:-1]).all()


@pytest.mark.parametrize("arguments, message", [
    (dict(), "wind has nothing: give one of force, traction, pressure"),
    (dict(force=(0, 1), pressure=1.0), "wind has force and pressure: give one of"),
    (dict(pressure=(1.0, 2.0)), r"the pressure of wind is \(1.0, 2.0\): give numbers of shape \(\) \(one "
     r"number\)"),
    (dict(traction=1.0), r"the traction of wind is 1.0: give numbers of shape \(2,\)"),
    (dict(force=(0, np.nan)), r"the force of wind \(entry 1\) is nan: give finite"),
])
def test_load_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        Load(Interface.line((0.0, 0.0), (1.0, 0.0), 4), name="wind", **arguments)


def test_scene_says_what_is_wrong(make_mpm):
    bare = Interface(np.array([[0.5, 0.5]]), np.zeros((0, 2), int))
    with pytest.raises(ValueError, match="wind has a pressure, but its surface has no elements"):
        Load(bare, pressure=1.0, name="wind")
    with pytest.raises(ValueError,
                       match=r"particle 2 of wind lies at \[4.5 0. \] m, outside the grid: enlarge"):
        make_mpm(loads=[Load(Interface.line((0.0, 0.0), (9.0, 0.0), 4), pressure=1.0, name="wind")])
    with pytest.raises(ValueError, match="surface of wind has 3 dimensions, the scene 2"):
        make_mpm(loads=[Load(Interface.patch((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1)), pressure=1.0,
                             name="wind")])
    with pytest.raises(ValueError, match=r"the value of the force of wind at t = 0.005 s \(entry 0\) is nan: "
                       r"give finite"):
        make_mpm(loads=[Load(bare, force=lambda t: np.array([np.nan, 0.0]), name="wind")]).advance(0.01)
