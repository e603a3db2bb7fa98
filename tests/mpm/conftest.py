"""Laws at one point, small bodies and PETSc options for the MPM tests."""
from types import SimpleNamespace

import numpy as np
import pytest
from petsc4py import PETSc

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface, Mesh, herschel_bulkley
from mpm_fenicsx.laws import bound, kernels, lame
from mpm_fenicsx.laws.stress_state import point_functions
from mpm_fenicsx.scene.lattice import lattice

TOO_STRONG_TO_YIELD = {"mohr_coulomb": dict(friction_angle=30.0, cohesion=1e9),
                       "drucker_prager": dict(friction_angle=30.0, cohesion=1e9),
                       "von_mises": dict(yield_stress=1e9)}

SOFT = LAWS["linear"](1e3, 0.3)
# per body cell of small tests
POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}


@pytest.fixture(params=sorted(POINTS))
def any_cell(request):
    """All four kinds."""
    return request.param


@pytest.fixture
def distorted():
    """``distorted(cell, counts, by)``: see ``make_distorted``."""
    return make_distorted


def make_distorted(cell, counts=None, by=0.2, box=None, seed=1):
    """Mesh of a box (default 2 x 1.5 [x 1] m), inner vertices moved by up to ``by`` of a cell's size, cells
    shuffled."""
    D = 2 if cell in ("quadrilateral", "triangle") else 3
    box = box or Box((0.0, 0.0, 0.0)[:D], (2.0, 1.5, 1.0)[:D])
    counts = counts or (4, 3, 2)[:D]
    vertices, cells = lattice(box, counts, cell)
    rng = np.random.default_rng(seed)
    inner = ((vertices > box.lower) & (vertices < box.upper)).all(axis=1)
    vertices[inner] += by * box.size / counts * rng.uniform(-1, 1, (inner.sum(), D))
    return Mesh(vertices, cells[rng.permutation(len(cells))], cell)


def _mud(E, nu):
    """Herschel–Bulkley by the constants of the others."""
    lam, mu = lame(E, nu)
    return herschel_bulkley(lam + 2.0 / 3.0 * mu, 1.0, 1e9, 1.0, mu, None)


# Laws that bear no tension, whose shear flows where nothing presses.
LOOSE = {"mu_i", "cam_clay"}


@pytest.fixture(params=sorted(set(LAWS) - LOOSE))
def make_law(request):
    """``make_law(E, nu)``: every law, in its elastic range."""
    if request.param == "herschel_bulkley":
        return _mud
    return lambda E, nu: LAWS[request.param](E, nu, **TOO_STRONG_TO_YIELD.get(request.param, {}))


@pytest.fixture
def law(make_law):
    return make_law(1.0, 0.3)


@pytest.fixture(params=["plane_strain", "plane_stress", "three_dimensional"])
def stress_state(request):
    return request.param


@pytest.fixture(params=["quadrilateral", "triangle"])
def cell(request):
    return request.param


@pytest.fixture
def at_point():
    """``at_point(law, stress_state)``: the law as functions of F alone, see ``make_point``."""
    return make_point


def make_point(law, stress_state, dt=0.1):
    """P(F), A(F) and P33(F) [Pa], W(F) [J/m^3], F33(F) and the dimension; the old stretch F33 is 1, as are
    all states. P has the shape of F, A = dP/dF twice that."""
    D = 3 if stress_state == "three_dimensional" else 2
    point_stress, point_tangent = point_functions(law, stress_state, D)
    plain_energy = bound(law, law.energy, D)
    old, new = np.zeros(2, law.state)

    def call(function, F):
        P, A = np.zeros(D * D + 1), np.zeros((D * D + 1, D * D + 1))
        F33 = function(law.params, np.ascontiguousarray(F, float), 1.0, dt, old, new, P, A)
        return P[:-1].reshape(D, D), A[:-1, :-1].reshape(D, D, D, D), P[-1], F33

    def energy(F):
        return plain_energy(law.params, np.ascontiguousarray(F, float), call(point_stress, F)[3], old)

    return SimpleNamespace(dim=D, P=lambda F: call(point_stress, F)[0], A=lambda F: call(point_tangent, F)[1],
                           P33=lambda F: call(point_stress, F)[2], F33=lambda F: call(point_stress, F)[3],
                           W=energy, tangent_P=lambda F: call(point_tangent, F)[0], kernels=kernels(law, D))


class Element:
    """One point of a material led along a path. ``new`` holds the state that ``step`` would keep."""

    def __init__(self, law, dim, dt=0.1):
        self.law, self.dim, self.n, self.dt = law, dim, dim * dim, dt
        self._stress, self._tangent = kernels(law, dim)
        self.states = np.zeros(2, law.state)

    old, new = (property(lambda self, i=i: self.states[i]) for i in (0, 1))

    def _call(self, kernel, F):
        F = np.ascontiguousarray(F, float)
        P, A = np.full(self.n + 1, 7.0), np.full((self.n + 1, self.n + 1), 7.0)
        if kernel is self._tangent:
            kernel(self.law.params, F, 1.0, self.dt, self.old, self.new, P, A)
        else:
            answer = kernel(self.law.params, F, 1.0, self.dt, self.old, self.new, P)
            self.region = answer[-1] if answer else None  # where the return mapping of a plastic law went
        return P, A

    def P(self, F):
        """First Piola–Kirchhoff stress, shape of F; ``region`` then tells where the return mapping went."""
        return self._call(self._stress, F)[0][:-1].reshape(self.dim, self.dim)

    def A(self, F):
        return self._call(self._tangent, F)[1][:-1, :-1].reshape(4 * (self.dim,))

    def tau(self, F):
        """Kirchhoff stress, shape (3, 3)."""
        P, tau = self._call(self._stress, F)[0], np.zeros((3, 3))
        tau[:self.dim, :self.dim] = P[:-1].reshape(self.dim, self.dim) @ np.transpose(F)
        tau[2, 2] += P[-1]  # 0 in space
        return tau

    def step(self, F):
        """Kirchhoff stress of a step that ends at F; the state goes along."""
        tau = self.tau(F)
        self.states[0] = self.states[1]
        return tau


@pytest.fixture
def element():
    """``element(law, dim, dt)``, see ``Element``."""
    return Element


@pytest.fixture
def taylor_rate():
    """``taylor_rate(f, df, h)``: observed order of f(h) - f(0) - h df as the step h is halved; 2 for a
    derivative."""
    def rate(f, df, h=1e-3):
        start = f(0.0)
        first, second = (np.linalg.norm(f(s) - start - s * df) for s in (h, h / 2))
        return np.log2(first / second)
    return rate


@pytest.fixture
def check_matrix(taylor_rate):
    """``check_matrix(solid, random, size, h)``: at random displacements of up to ``size`` [m] the matrix of a
    step is the derivative of its residual, seen at ``h`` times such a displacement, and symmetric. All that
    makes a kink must be farther away than that."""
    def check(solid, random, size, h):
        solid._locate()
        step, trials = solid.step, []
        step.begin(0.02, 0.0, np.zeros((0, 2)))
        shape, active = (step.active_cells.node.size, 2), np.repeat(step.active, 2)
        u, du = np.where(step.active[:, None], random.uniform(-size, size, (2, *shape)), 0.0)

        def residual(x):
            r = np.empty(shape)
            trials.append(step.equations.residual(x, r))
            return r.ravel()[active]

        assert np.isfinite(residual(u)).all()
        step.newton.make_tangent(trials[0])
        K = step.active_cells.matrix.convert("dense").getDenseArray()[np.ix_(active, active)]
        rate = taylor_rate(lambda s: residual(u + s * du), K @ du.ravel()[active], h=h)
        assert rate == pytest.approx(2.0, abs=0.05)
        np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-14 * abs(K).max())

    return check


@pytest.fixture
def options():
    """``options(snes_rtol=1e-12, …)``: PETSc options of the MPM, taken back at the end of the test."""
    database, names = PETSc.Options("mpm_"), []

    def put(**values):
        for name, value in values.items():
            names.append(name)
            database[name] = value
    yield put
    for name in names:
        database.delValue(name)


@pytest.fixture
def start():
    """``start(grid, bodies, …)``: an ``MPM``, closed at the end of the test."""
    opened = []

    def make(*args, **more):
        opened.append(MPM(*args, **more))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


@pytest.fixture
def make_mpm(start):
    """``make_mpm(**changes)``: a soft block of 2 m x 1 m, two grid cells away from the edges of its grid
    (cells of 0.5 m), with loads on its upper edge; keywords replace arguments of Grid, Body or MPM."""
    def make(cell="quadrilateral", box=((0.0, 0.0), (2.0, 1.0)), h=0.5, margin=2, law=SOFT, rho=1.0,
             body_cells=None, points=None, stress_state=None, thickness=1.0, velocity=0.0, segments=4,
             grid=None, shift=0.1, f_bar=False, **others):
        box = Box(*box)
        if grid is None:
            lower, upper = np.subtract(box.lower, margin * h), np.add(box.upper, margin * h)
            grid = Grid(Box(tuple(lower), tuple(upper)), Grid.counts(upper - lower, h), cell)
        body = Body(box, body_cells or Grid.counts(box.size, h), points or POINTS[cell], law,
                    rho, stress_state, thickness, cell, velocity, f_bar)
        others.setdefault("interface", Interface.top(box, segments, shift) if box.dim == 2 else None)
        return start(grid, body, **others)

    return make
