"""Adhesion: a stress times the area of the overlap, the law of LIGGGHTS' `cohesion sjkr` (both back ends)."""
import numpy as np
import pytest
from scipy.integrate import trapezoid

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, contact_energy

R, E, PULL = 0.01, 1e7, 2e5
SOFT = Material(E, 0.3)
HERTZ = 4 / 3 * E / (2 * (1 - 0.3**2))  # times sqrt(R*) d^1.5


def pull_off(stiffness, per_depth):
    """Largest pull of k d^1.5 - a d: at d = (a / 1.5 k)^2, a^3 / (6.75 k^2)."""
    return (per_depth / (1.5 * stiffness)) ** 2, per_depth**3 / (6.75 * stiffness**2)


def test_pull_off_from_a_wall(dem, sheet, dim):
    """The force over the overlap, k d^1.5 - c pi (2 R d - d^2), and its largest pull; the sphere is too heavy
    to move."""
    wall, up = sheet(dim), np.eye(dim)[-1]
    scene = Scene(Spheres([1.5 * R * up], [0 * up], R, 1e15), wall, SOFT, SOFT,
                  at_wall=Interaction(1.0, 0.0, PULL))
    ball, nodes, force = dem(scene, 1e-9), np.array(wall.nodes), []
    depth, largest = pull_off(HERTZ * np.sqrt(R), 2 * np.pi * R * PULL)
    overlaps = depth * np.linspace(0.05, 3.0, 60)
    for d in overlaps:
        lifted = nodes + (0.5 * R + d) * up
        force.append([-ball.advance(1, lifted, 0 * nodes)[:, -1].sum() for _ in range(2)][1])
    exact = HERTZ * np.sqrt(R) * overlaps**1.5 - PULL * np.pi * (2 * R * overlaps - overlaps**2)
    assert np.array(force) == pytest.approx(exact, rel=1e-9, abs=1e-9 * largest)
    assert -min(force) == pytest.approx(largest, rel=0.02)
    assert overlaps[np.argmin(force)] == pytest.approx(depth, rel=0.05)
    inside = np.array(nodes) + (0.5 * R + depth) * up
    work = trapezoid(np.r_[0.0, exact[overlaps <= depth * 1.001]],
                    np.r_[0.0, overlaps[overlaps <= depth * 1.001]])
    assert contact_energy(scene, scene.spheres.x, inside) == pytest.approx(work, rel=0.01)


def test_pull_between_two_spheres(dem, sheet):
    """The momentum they exchange per step is the mean of k d^1.5 - c A with A the area of the circle in which
    they cut each other; and energy is kept while they stick, swing and part."""
    a, b, v = 0.01, 0.006, 0.2
    scene = Scene(Spheres([[0.0, 0.05], [a + b, 0.05]], [[v, 0.0], [-v, 0.0]], [a, b], 2500.0), sheet(2),
                  SOFT, SOFT, between=Interaction(1.0, 0.0, PULL))
    pair, nodes = dem(scene, 1e-6), np.array(scene.wall.nodes)
    seen, start, energy = [pair.particles()], sum(pair.energy().values()), []
    for _ in range(600):
        pair.advance(1, nodes, 0 * nodes)
        seen.append(pair.particles())
        energy.append(sum(pair.energy().values()))
    r = np.array([p["x"][1, 0] - p["x"][0, 0] for p in seen])
    area = np.pi / 4 * ((a + b) ** 2 - r**2) * (r**2 - (a - b) ** 2) / r**2
    d = np.maximum(a + b - r, 0.0)
    exact = np.where(d > 0, HERTZ * np.sqrt(a * b / (a + b)) * d**1.5 - PULL * area, 0.0)
    force = -np.diff([p["v"][0, 0] for p in seen]) * scene.spheres.mass[0] / 1e-6
    assert force == pytest.approx((exact[1:] + exact[:-1]) / 2, abs=1e-7 * np.abs(exact).max())
    assert exact.min() < -0.1 * exact.max() and d.max() > 0
    assert np.abs(np.array(energy) / start - 1).max() < 1e-4


@pytest.mark.parametrize("load, holds", [(0.9, True), (1.2, False)])
def test_block_hangs_from_a_ceiling(dem, load, holds):
    """Up to the sum of the pull-off forces of its eight spheres in touch, and no further. It is pushed there
    first."""
    r, n, size = 0.00125, 8, (0.02, 0.018)
    stiffness = HERTZ * np.sqrt(r)
    depth, each = pull_off(stiffness, 2 * np.pi * r * PULL)
    mass = 8 * each * load / 9.81
    rho = mass / (size[0] * size[1] * 0.1)
    block = Cluster.box(size, (n, n), (0.0, -0.009), rho, depth=0.1, rim=True, v=(0.0, 0.05))
    ceiling = Wall([[0.1, 0.0], [-0.1, 0.0]], [[0, 1]])
    hung = dem(Scene(clusters=[block], wall=ceiling, material=SOFT, wall_material=SOFT, gravity=(0.0, -9.81),
                     at_wall=Interaction(0.05, 0.5, PULL)), 1e-5)
    nodes = np.array(ceiling.nodes)
    hung.advance(20000, nodes, 0 * nodes)
    top = hung.bodies()["x"][0, 1] + 0.009
    assert (top > 0.0 and abs(hung.bodies()["v"][0, 1]) < 1e-4) if holds else top < -0.01
