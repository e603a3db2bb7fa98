"""What is left of the beam's errors when everything is refined: beam theory, dent, supports, grid, windows,
one by one.

    python tests/benchmarks/bench_floor.py [scenes=2,3,three] [runs=yes|no|only]

The beam is solved once more without MPM and without coupling: eigenmodes of a finite element model (tensor
products of 1D elements, quadratic and graded towards the load, or the linear ones of a background grid) take
the place of the modes of the Timoshenko beam in ``beam_theory.impact``, which integrates them exactly against
Hertz's law. Each row changes one thing. What the finite elements give is what a coupled run tends to; coupled
runs follow. Prints Markdown tables.
"""
import shutil
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import bmat, csc_matrix, csr_matrix, kron
from scipy.sparse.linalg import eigsh, splu

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "cases")]
from coupling.records import history, report  # noqa: E402
from references import beam_theory  # noqa: E402
from studies import sweep  # noqa: E402

H, W, V0, E, NU, RHO = 0.01, 0.01, 0.01, 215.82e9, 0.289, 7960.0


class Scene(NamedTuple):
    """Beam and sphere: length and radius [m], end of the run [s], modes of the reference, dimensions,
    case."""

    length: float
    radius: float
    t_end: float
    modes: int
    dim: int
    case: str


SCENES = {"2": Scene(0.1535, 0.01, 4e-4, 50, 2, "beam_impact"), "3": Scene(0.1535, 0.01, 4e-4, 50, 3,
                                                                           "beam_impact"),
          "three": Scene(0.307, 0.02, 4e-3, 500, 2, "multiple_impact")}
TITLES = {"2": "beam in the plane", "3": "beam in space", "three": "three impacts, in the plane"}
GAUSS = np.polynomial.legendre.leggauss(4)


def line(x, order):
    """1D elements between the places x [m]: their nodes, and the matrices of N N, N' N, N N' and N' N', by
    the (left, right) derivatives."""
    nodes = x if order == 1 else np.sort(np.concatenate([x, 0.5 * (x[1:] + x[:-1])]))
    reference = np.linspace(-1, 1, order + 1)
    basis = [np.polynomial.Polynomial.fromroots(np.delete(reference, i)) for i in range(order + 1)]
    basis = [b / b(reference[i]) for i, b in enumerate(basis)]
    values = np.array([b(GAUSS[0]) for b in basis]), np.array([b.deriv()(GAUSS[0]) for b in basis])
    matrices = {}
    for left in (0, 1):
        for right in (0, 1):
            element, rows, columns, data = np.einsum("iq,jq,q->ij", values[left], values[right],
                                                     GAUSS[1]), [], [], []
            for e, size in enumerate(np.diff(x)):
                number = order * e + np.arange(order + 1)
                rows += np.repeat(number, order + 1).tolist()
                columns += np.tile(number, order + 1).tolist()
                data += (element * (size / 2) ** (1 - left - right)).ravel().tolist()
            matrices[left, right] = csr_matrix((data, (rows, columns)), (len(nodes), len(nodes)))
    return nodes, matrices


def along(parts):
    """Kronecker product, the first direction slowest."""
    product = parts[0]
    for part in parts[1:]:
        product = kron(product, part, "csr")
    return product


def solid(axes, order, thickness=1.0):
    """Places of the nodes [m], shape (n, D), stiffness and mass matrix, D components one after the other;
    plane stress or in space. axes: places of the elements' ends along each direction."""
    D, lines = len(axes), [line(np.asarray(x), order) for x in axes]
    mu, lam = E / (2 * (1 + NU)), (E * NU / (1 - NU**2) if len(axes) == 2
                                   else E * NU / ((1 + NU) * (1 - 2 * NU)))
    gradients = {(a, b): along([m[int(d == a), int(d == b)] for d, (_, m) in enumerate(lines)])
                 for a in range(D) for b in range(D)}
    laplace = sum(gradients[a, a] for a in range(D))
    blocks = [[lam * gradients[i, j] + mu * gradients[j, i] + (mu * laplace if i == j else 0 * laplace)
               for j in range(D)] for i in range(D)]
    places = np.stack(np.meshgrid(*[nodes for nodes, _ in lines], indexing="ij"), -1).reshape(-1, D)
    mass = RHO * along([m[0, 0] for _, m in lines])
    return places, thickness * bmat(blocks,
                                    "csc"), thickness * bmat([[mass if i == j else None for j in range(D)]
                                                              for i in range(D)], "csc")


def struck(axes, order, load, support, modes, half=True):
    """(omega, modal mass) of a beam, or of the half or quarter of it beyond the planes of symmetry at x = 0
    and z = 0; one more mode stands for the give of all that are left out. load: function of the places and of
    the lengths that belong to each node, weights of the nodes that carry the force and whose mean motion is
    the deflection; support: of the places, those that are held upright."""
    places, K, M = solid(axes, order, W if len(axes) == 2 else 1.0)
    n, D = places.shape
    held = np.zeros((D, n), bool)
    held[1, support(places)] = True
    for d in {0, D - 1} - {1} if half else ():
        held[d, np.isclose(places[:, d], 0)] = True
    free = np.flatnonzero(~held.ravel())
    push = np.zeros((D, n))
    push[1] = load(places, lengths(axes, order))
    parts = 2 ** (D - 1) if half else 1
    push = push.ravel()[free] / push.sum() / parts  # this part's share of a force of 1
    K, M = csc_matrix(K[free][:, free]), csc_matrix(M[free][:, free])
    values, shapes = eigh(K.toarray(), M.toarray()) if len(free) < 800 else eigsh(K, modes, M, sigma=-1e6)
    share = (push @ shapes) ** 2 * parts
    moved = share > 1e-9 * share.max()
    omega, share = np.sqrt(values[moved]), share[moved]
    mass = 1 / share
    # the shift: nothing holds the beam along x
    static = push @ splu(csc_matrix(K + 1e2 * M)).solve(push) * parts
    give = static - np.sum(share / omega**2)
    if give > 1e-6 * np.sum(share / omega**2):
        omega, mass = np.append(omega, 3 * omega[-1]), np.append(mass, 1 / (9 * give * omega[-1] ** 2))
    return omega, mass


def lengths(axes, order):
    """Length [m] that belongs to each node, shape (D, n)."""
    own = [np.asarray(m[0, 0].sum(axis=1)).ravel() for _, m in (line(np.asarray(x), order) for x in axes)]
    return np.stack(np.meshgrid(*own, indexing="ij")).reshape(len(axes), -1)


def spread(width):
    """Load on the upper side as that of a grid with cells of ``width`` [m] of which two nodes lie beside the
    middle: even between them, down to nothing over the next cell."""
    def weights(places, own):
        beside = [d for d in range(len(own)) if d != 1]
        hats = [np.clip(1.5 - np.abs(places[:, d]) / width, 0, 1) * own[d] for d in beside]
        return np.prod(hats, axis=0) * np.isclose(places[:, 1], 0)
    return weights


def on_nodes(size):
    """Load of a point in the middle of the upper side on the nodes of linear cells of ``size`` [m], shape
    (D,)."""
    def weights(places, own):
        hats = [np.clip(1 - np.abs(places[:, d]) / size[d], 0, 1) for d in range(len(own)) if d != 1]
        return np.prod(hats, axis=0) * np.isclose(places[:, 1], 0)
    return weights


def over_the_height(places, own):
    """Shear as in the beam: a parabola over the section in the middle; it leaves no dent."""
    return np.isclose(places[:, 0], 0) * (0.25 - (places[:, 1] / H + 0.5) ** 2) * np.prod(own[1:], axis=0)


def column(places):
    return np.isclose(np.abs(places[:, 0]), places[:, 0].max())


def middle(places):
    return column(places) & np.isclose(places[:, 1], -H / 2)


def corner(places):
    return column(places) & np.isclose(places[:, 1], -H)


def graded(size, count, finest):
    """Places from 0 to ``size`` [m], cells growing from ``finest`` [m] on."""
    growth = np.geomspace(1, max(2 * size / count / finest, 1.0001), count)
    x = np.concatenate([[0], np.cumsum(finest * growth)])
    return x * size / x[-1]


def fine(scene):
    """Axes of the fine mesh."""
    half = scene.length / 2
    if scene.dim == 3:
        return [graded(half, 20, 5e-4), -graded(H, 6, 5e-4)[::-1], graded(W / 2, 4, 5e-4)]
    y = -graded(H, 20, 1.5e-4)[::-1]
    # a node at half height
    return [graded(half, 60, 2.5e-4), np.sort(np.append(y[np.abs(y + H / 2) > 3e-4], -H / 2))]


@lru_cache(None)
def reference(scene):
    return impact(scene, scene.modes)


def impact(scene, modes, **changes):
    return beam_theory.impact(scene.length, H, W, scene.radius, V0, E, NU, RHO, scene.t_end, modes=modes,
                              **changes)


def errors(scene, modes, **changes):
    """Force, deflection, the sphere's final speed and the last peak against the reference, for other
    ``modes``."""
    own, other = reference(scene), impact(scene, modes, **changes)
    return (report.relative_l2(other.force, own.force), report.relative_l2(other.u_beam, own.u_beam),
            abs(other.v_sphere[-1] / own.v_sphere[-1] - 1),
            other.contacts()[-1].peak / own.contacts()[-1].peak - 1)


def rows_of_theory(scene):
    if scene.modes < 500:
        yield "Timoshenko's beam, 500 modes instead of 50", errors(scene, 500)
    yield "Cowper's shear coefficient instead of 5/6", errors(scene, scene.modes,
                                                              shear=10 * (1 + NU) / (12 + 11 * NU))
    yield "Euler-Bernoulli beam", errors(scene, scene.modes, theory="euler_bernoulli")


def rows_of_solid(scene):
    plane = scene.dim == 2
    count = 150 if plane else 80
    body = lambda load, support=column: errors(  # noqa: E731
        scene, struck(fine(scene), 2, load, support, count))
    place = "plane stress" if plane else "solid in space"
    yield f"{place}, force over the section (no dent)", body(over_the_height)
    if plane:
        yield "the same, held at half height instead of the whole end", body(over_the_height, middle)
        yield "the same, held at the lower edge", body(over_the_height, corner)
    for width in (4e-3, 2e-3, 1e-3, 5e-4)[:4 if plane else 3]:
        yield f"{place}, force on top over two nodes {1e3 * width:g} mm apart", body(spread(width))
    for h in (5e-3, 2.5e-3, 2e-3, 1e-3)[:4 if plane else 3]:
        axes = [np.linspace(-H, 0, round(H / h) + 1) if d == 1 else np.linspace(-s / 2, s / 2,
                                                                                round(s / h) + 1)
                for d, s in enumerate([scene.length, H, W][:scene.dim])]
        size = [axis[1] - axis[0] for axis in axes]
        yield (f"linear cells of {1e3 * h:.3g} mm, force on the nodes at the middle",
               errors(scene, struck(axes, 1, on_nodes(size), column, count, half=False)))


def table(title, rows):
    print(f"\n{title}\n\n| | force | deflection | final speed of the sphere | last peak |\n" + "|" + " --- |"
          * 5)
    for name, values in rows:
        cells = [name, *(f"{value:.2%}" for value in values[:3]), f"{values[3]:+.2%}"]
        print("| " + " | ".join(cells) + " |", flush=True)


RUNS = {"2": ["h=5e-3 body=31x2", "h=2.5e-3 body=61x4", "h=2e-3 body=77x5",
              "h=1e-3 body=154x10",  # points that fit
              "h=2e-3 body=77x5 points=4", "h=2e-3 body=77x8", "h=2e-3 body=120x5", "h=2e-3 body=120x8",
              "h=2e-3 body=120x8 points=4", "h=2e-3 body=77x5 dt=8e-6 substeps=80",
              "h=2e-3 body=77x5 dt=5e-7 substeps=5", "h=2e-3 body=77x5 dt=2e-7 substeps=2",
              "h=2e-3 body=77x5 plane=strain"],
        "3": ["h=5e-3 body=31x2x2", "h=2.5e-3 body=61x4x4", "h=2e-3 body=77x5x5", "h=2e-3",
              "h=2e-3 dt=5e-7 substeps=5", "h=2e-3 segments=31x3"],
        "three": ["h=2e-3 body=154x5", "h=2e-3", "h=1e-3 body=307x10",
                  "h=2e-3 body=154x5 dt=1e-6 substeps=10"]}


def rows_of_runs(name):
    """Coupled runs: cells, points and windows, one at a time. The last peak is that of the history's
    windows."""
    scene = SCENES[name]
    own = reference(scene).contacts()[-1].peak
    with tempfile.TemporaryDirectory() as folder:
        for changes in RUNS[name]:
            keys = dict(word.split("=") for word in changes.split())
            result = sweep.run(ROOT / f"cases/{scene.case}.py", keys, [f"dim={scene.dim}"], folder)
            if result.status != "ok":
                raise RuntimeError(f"{changes}: {result.status}")
            run = next(path for path in Path(folder).glob("*/history.csv"))
            times = history.read(run)
            peak = beam_theory.contacts(times["time"], times["force"])[-1].peak / own - 1
            shutil.rmtree(run.parent)
            yield (f"coupled run, `{changes}`",
                   [*(result.errors[key] for key in ("force", "u_beam", "v_sphere_end")), peak])


def main(given):
    for name in given.get("scenes", "2,3,three").split(","):
        scene = SCENES[name]
        if given.get("runs") != "only":
            table(f"{TITLES[name]}: the reference itself", rows_of_theory(scene))
            table(f"{TITLES[name]}: modes of finite elements in place of the beam's", rows_of_solid(scene))
        if given.get("runs") != "no":
            table(f"{TITLES[name]}: coupled runs", rows_of_runs(name))


if __name__ == "__main__":
    main(dict(word.split("=", 1) for word in sys.argv[1:]))
