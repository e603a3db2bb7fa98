"""Nanoseconds per point of each law's stress and tangent, on a body in flow.

    python tests/benchmarks/bench_laws.py [points=19200] [repeat=50]

Prints a Markdown table; nothing passes or fails here.
"""
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]
from energy_law import rubber  # noqa: E402
from own_law import damped  # noqa: E402
from ufl import det, ln, tr  # noqa: E402

from mpm_fenicsx import (  # noqa: E402
    cam_clay,
    drucker_prager,
    from_energy,
    linear,
    mohr_coulomb,
    neo_hooke,
    von_mises,
)
from mpm_fenicsx.compiled import specialise  # noqa: E402
from mpm_fenicsx.laws import kernels, lame  # noqa: E402

D = 2
stress = tangent = None


def all_stresses(p, F, old, new, P, A):
    for q in range(len(F)):
        stress(p, F[q], 1.0, 1e-3, old[q], new[q], P)


def all_tangents(p, F, old, new, P, A):
    for q in range(len(F)):
        tangent(p, F[q], 1.0, 1e-3, old[q], new[q], P, A)


def neo_hookean(F, mu, lam):
    """The energy of ``neo_hooke``."""
    return mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) + lam / 2 * ln(det(F)) ** 2


def measure(law, dim, points, repeat):
    """Best times [ns] per point, and the shares of points that flow and that have opened."""
    random = np.random.default_rng(0)
    F = 0.996 * np.eye(dim) + 0.01 * random.normal(size=(points, dim, dim))
    old, new = np.zeros((2, points), law.state)
    n, (law_stress, law_tangent) = dim * dim + 1, kernels(law, dim)
    loops = (specialise(all_stresses, stress=law_stress), specialise(all_tangents, tangent=law_tangent))
    P, A, best = np.zeros(n), np.zeros((n, n)), [np.inf, np.inf]
    loops[0](law.params, F, old, new, P, A)
    old[:] = new
    F = F @ (np.eye(dim) + 0.002 * random.normal(size=(points, dim, dim)))
    for _ in range(repeat + 1):
        for i, loop in enumerate(loops):
            start = perf_counter()
            loop(law.params, F, old, new, P, A)
            best[i] = min(best[i], perf_counter() - start)
    if "opened" not in law.state.names:
        return *(1e9 * t / points for t in best), 0.0, 0.0
    flowing = np.mean(new["plastic_strain"] > old["plastic_strain"])
    return *(1e9 * t / points for t in best), flowing, np.mean(new["opened"] > 0)


def main(points=19200, repeat=50):
    lam, mu = lame(5e4, 0.4)
    laws = [linear(5e4, 0.4), neo_hooke(5e4, 0.4), mohr_coulomb(5e4, 0.4, 22.0),
            drucker_prager(5e4, 0.4, 22.0), von_mises(5e4, 0.4, 100.0),
            damped(5e4, 0.4, 100.0), cam_clay(25.0, 0.1, 0.02, 1e6, 3e4),
            from_energy(neo_hookean, mu=mu, lam=lam), rubber(5e3, 2e3, 8e4)]
    print("| law | dimensions | stress [ns] | tangent [ns] | flowing | opened |\n| --- | --- | --- | --- | "
          "--- | --- |")
    for dim in (2, 3):
        for law in laws:
            times = measure(law, dim, points, repeat)
            print("| {} | {} | {:.0f} | {:.0f} | {:.0%} | {:.0%} |".format(law.name, dim, *times), flush=True)


if __name__ == "__main__":
    main(**{key: int(value) for key, value in (word.split("=") for word in sys.argv[1:])})
