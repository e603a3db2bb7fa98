"""A layer of clay that is sheared until it fails in a band, one row of cells that is a little weaker."""
import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Support, mohr_coulomb, softened

HEIGHT, E, NU, PEAK, RESIDUAL, WEAKER = 1.0, 3e6, 0.49, 1e3, 400.0, 0.95
LENGTH, STRAIN = 0.25, 0.02  # of a band: residual after a slip of 5 mm


def clay(share, length):
    """Cohesion alone, ``share`` of it."""
    return softened(*(mohr_coulomb(E, NU, 0.0, cohesion=share * c) for c in (PEAK, RESIDUAL)), STRAIN,
                    length)


def sheared(n, regular=True, slide=0.008, steps=80):
    """Slide of the top [m] and shear stress in the bed [Pa] of a layer of ``n`` rows after each step;
    regular: with the slip of a band as wide as ``LENGTH``, else with its strain."""
    h = HEIGHT / n
    length = LENGTH if regular else h
    row = h * (n // 2)
    layers = [(0.0, row), (row, row + h), (row + h, HEIGHT)]
    bodies = [Body(Box((0.0, low), (2 * h, high)), (2, round((high - low) / h)), 2, clay(share, length), 1.0)
              for (low, high), share in zip(layers, (1.0, WEAKER, 1.0))]
    supports = [Support(lambda x: x[:, 1] > -1.0, "y"), Support(lambda x: x[:, 1] < 1e-9, "x"),
                Support(lambda x: x[:, 1] > HEIGHT - 1e-9, "x", lambda t: slide * t, name="top")]
    layer = MPM(Grid(Box((0.0, 0.0), (2 * h, HEIGHT)), (2, n)), bodies, supports, inertia="lumped",
                bonded=True)
    curve = [(0.0, 0.0)]
    for k in range(steps):
        layer.advance(1.0 / steps)
        curve.append((slide * (k + 1) / steps, layer.cauchy_stress()[:, 0, 1].mean()))
    layer.close()
    return np.array(curve).T


def exact(u):
    """Shear stress at the slides u: elastic, then with the slip of the band, then residual."""
    G = E / (2 * (1 + NU))
    peak, residual, slip = WEAKER * PEAK, WEAKER * RESIDUAL, STRAIN * LENGTH
    falls = (peak - residual) / slip  # u = tau / G + (peak - tau) / falls
    return np.minimum(G * u, np.maximum((u - peak / falls) / (1.0 / G - 1.0 / falls), residual))
