"""A sample of clay pressed between smooth plates until it fails in a band, from a corner that is weaker."""
import numpy as np

from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Support, mohr_coulomb, softened

SIZE, CORNER, WEAKER = (0.5, 1.0), 0.125, 0.9
E, NU, PEAK, RESIDUAL = 3e6, 0.45, 1e3, 400.0
LENGTH, STRAIN = 0.25, 0.02  # of a band: residual after a slip of 5 mm


def _clay(share, length):
    """Cohesion alone, ``share`` of it."""
    return softened(*(mohr_coulomb(E, NU, 0.0, cohesion=share * c) for c in (PEAK, RESIDUAL)), STRAIN,
                    length)


def _bodies(h, length):
    """The sample and its weak corner, four points in a cell."""
    rows = [(np.arange(round(2 * size / h)) + 0.5) * h / 2 for size in SIZE]
    x = np.stack(np.meshgrid(*rows), axis=-1).reshape(-1, 2)
    weak = (x < CORNER).all(axis=1)
    return [Body(Cloud(x[part], np.full(part.sum(), h * h / 4), np.full((part.sum(), 2), h / 4)), None, None,
                 _clay(share, length), 1.0, f_bar=True) for part, share in ((~weak, 1.0), (weak, WEAKER))]


def pressed(n, regular=True, shortening=0.008, steps=80):
    """Shortening [m] and mean axial stress [Pa] after each step of a sample of ``n`` rows of cells; positions
    [m] and plastic strain of the points at the end. regular: with the slip of a band as wide as ``LENGTH``,
    else with its strain."""
    h = SIZE[1] / n
    supports = [Support(lambda x: x[:, 1] < 1e-9, "y"),
                Support(lambda x: (x[:, 1] < 1e-9) & (abs(x[:, 0]) < 1e-9), "xy"),
                Support(lambda x: x[:, 1] > SIZE[1] - 1e-9, "y", lambda t: -shortening * t, name="plate")]
    grid = Grid(Box((-4 * h, 0.0), (SIZE[0] + 4 * h, SIZE[1])), (n // 2 + 8, n))
    sample = MPM(grid, _bodies(h, LENGTH if regular else h), supports, inertia="lumped", bonded=True)
    curve, volume = [(0.0, 0.0)], np.concatenate([body.points.V0 for body in sample.bodies])
    for k in range(steps):
        sample.advance(1.0 / steps)
        stress = np.average(sample.cauchy_stress()[:, 1, 1], weights=volume)
        curve.append((shortening * (k + 1) / steps, -stress))
    sample.close()
    x, strain = (np.concatenate([get(body.points) for body in sample.bodies])
                 for get in (lambda p: p.x, lambda p: p.state["plastic_strain"]))
    return np.array(curve).T, x, strain
