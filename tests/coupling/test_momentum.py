"""The ledger's impulses: all components, linear and angular, in a plane and in space."""
import numpy as np
import pytest

from coupling import Scheme, couple, nearest
from coupling.ledger.exchange import Ledger, impulse_error
from coupling.ledger.momentum import Momentum, rotation, turning
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, quaternion
from tests.coupling.toys import INNER, Ball, Oscillator

SOFT, DT = Material(1e7, 0.3), 2e-5


@pytest.fixture(params=[2, 3])
def dim(request):
    return request.param


def tumbling(dim):
    """Two spheres about to hit each other obliquely with friction, a spinning cluster, gravity along every
    axis."""
    x, v = np.zeros((2, dim)), np.zeros((2, dim))
    x[:, 0], x[:, 1], v[:, 0] = (-0.0101, 0.0101), (0.05, 0.055), (1.0, -1.5)
    x[:, -1] += 0.01
    spin = {"omega": 20.0} if dim == 2 else {"omega": (20.0, -5.0, 3.0)}
    cluster = Cluster.box((0.02, 0.01, 0.015)[:dim], (2,) * dim, (0.3, 0.1, 0.2)[:dim], 1000.0,
                          0.01, v=(1.0, 2.0, 3.0)[:dim], **spin)
    return Scene(Spheres(x, v, 0.01, 2500.0), None, SOFT, None, Interaction(0.7, 0.5), clusters=[cluster],
                 gravity=(1.0, -9.81, 2.0)[:dim])


def test_nothing_but_gravity_gives_no_impulse(dem, dim):
    scene = tumbling(dim)
    grains, g = dem(scene, DT), np.array(scene.gravity)
    book = Momentum(grains, g, 0.0)
    size = book.now(grains.particles())
    none = np.zeros((0, dim))
    for _ in range(50):
        grains.advance(20, none, none)
        linear, angular = book.gained(grains.particles(), grains.time)
    particles = grains.particles()[:2]
    assert np.abs(particles["omega"]).max() > 1.0  # they have met
    assert np.abs(linear).max() < 1e-12 * np.abs(size[0]).max()
    assert np.abs(angular).max() < 1e-5 * np.abs(size[1]).max()


def test_rotation_is_that_of_the_bodies():
    q = np.random.default_rng(1).normal(size=4)
    q /= np.linalg.norm(q)
    assert rotation(q) == pytest.approx(quaternion.matrix(q), abs=1e-14)


def test_moments_are_cross_products():
    x, f = np.random.default_rng(2).normal(size=(2, 5, 3))
    assert turning(x, f) == pytest.approx(np.cross(x, f).sum(axis=0), abs=1e-14)
    plane = x[:, 0] @ f[:, 1] - x[:, 1] @ f[:, 0]
    assert turning(x[:, :2], f[:, :2]) == pytest.approx([plane], abs=1e-14)


class Slab:
    """A rigid body with three degrees of freedom at its nodes: all get the same velocity."""

    def __init__(self, x, mass):
        self.x, self.v, self.mass, self.time = np.array(x), np.zeros_like(x), mass, 0.0
        self.applied = np.zeros(x.shape[1])

    def surface(self):
        return self.x, self.v

    def advance(self, dt, force):
        self.applied = force.sum(axis=0)
        after = self.v + dt * self.applied / self.mass
        self.x, self.v, self.time = self.x + 0.5 * dt * (self.v + after), after, self.time + dt
        return self.x, self.v

    def energy(self):
        return {"kinetic": 0.5 * self.mass * float(self.v[0] @ self.v[0])}


def test_books_hold_every_component(dem, dim):
    """A spinning sphere strikes a body obliquely, away from the origin: what it gets, along and about every
    axis, is what it loses of its momentum; the other side books the same."""
    nodes = np.array([(0.0, 0.1), (0.1, 0.1)] if dim == 2 else
                     [(0.0, 0.1, 0.0), (0.0, 0.1, 0.1), (0.1, 0.1, 0.1), (0.1, 0.1, 0.0)])
    wall = Wall(nodes, [[0, 1]] if dim == 2 else [[0, 1, 2], [0, 2, 3]])
    x, v = np.array([[0.04, 0.11, 0.03]])[:, :dim], np.array([[1.0, -2.0, 0.5]])[:, :dim]
    scene = Scene(Spheres(x, v, 0.01, 2500.0), wall, SOFT, SOFT, at_wall=Interaction(0.9, 0.3))
    solid, grains, rows = Slab(nodes, 0.05), dem(scene, 2e-6), []
    ledger = Ledger(solid, grains)
    couple(solid, grains, nearest(nodes, nodes), Scheme(2e-5, 1.6e-3, substeps=10),
           on_window=[lambda window: rows.append(ledger(window))])
    books, after = {name: np.array([row[name] for row in rows])
                    for name in ledger.columns}, grains.particles()[0]
    change = after["mass"] * (after["v"][:dim] - v[0])
    assert change[1] > 0 and np.abs(change).min() > 0.05 * change[1]
    for axis, gained in zip(("_x", "", "_z"), change):
        given = books[f"impulse_grains{axis}"]
        assert given[-1] == pytest.approx(gained, rel=1e-12)
        assert np.abs(given + books[f"impulse_solid{axis}"]).max() < 1e-12 * change[1]
    begin, end = np.zeros(3), after["x"]
    begin[:dim] = x[0]
    turned = 0.4 * after["mass"] * 1e-4 * after["omega"] + after["mass"] * (
        np.cross(end, after["v"]) - np.cross(begin, np.pad(v[0], (0, 3 - dim))))
    for axis, gained in zip("z" if dim == 2 else "xyz", turned[-1 if dim == 2 else 0:]):
        given = books[f"angular_grains_{axis}"]
        assert given[-1] == pytest.approx(gained, rel=1e-10)
        # arm R - overlap/2
        assert np.abs(given + books[f"angular_solid_{axis}"]).max() < 0.01 * np.abs(turned).max()


def test_error_is_that_of_the_worst_component():
    class Books(dict):
        columns = property(dict.keys)

    books = Books(impulse_grains=np.array([0.0, 0.0]), impulse_solid=np.zeros(2),
                  impulse_grains_x=np.array([1.0, 2.0]), impulse_solid_x=np.array([-1.0, -1.9]))
    assert impulse_error(books) == pytest.approx(0.1 / 1.9)
    assert impulse_error(Books(impulse_grains=np.zeros(2), impulse_solid=np.zeros(2))) == 0.0


@pytest.mark.parametrize("gravity", [-2.0, (0.0, -2.0)])
def test_gravity_upward_or_by_components(gravity):
    solid, grains, rows = Oscillator(), Ball(gravity=-2.0), []
    ledger = Ledger(solid, grains, gravity)
    scheme = Scheme(80 * INNER, 10 * 80 * INNER, substeps=80)
    couple(solid, grains, nearest(*[np.zeros((1, 2))] * 2), scheme,
           on_window=[lambda window: rows.append(ledger(window))])
    assert abs(rows[-1]["impulse_grains"]) > 0.5
    assert rows[-1]["impulse_grains"] == pytest.approx(-rows[-1]["impulse_solid"], rel=1e-12)
