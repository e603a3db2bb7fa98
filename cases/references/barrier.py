"""Flows down a chute against a barrier: rooms and rocks for them, the figure of the force, and what a jet
would exert."""
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from coupling import History
from coupling.pictures import figure
from mpm_fenicsx import Box, Grid, Structure


def room(dim: int, lower: Sequence[float], upper: Sequence[float]) -> Box:
    """A box in space from ``lower`` to ``upper`` [m], or its part in the plane z = 0."""
    return Box(tuple(lower[:dim]), tuple(upper[:dim]))


def counts(box: Box, h: float) -> Tuple[int, ...]:
    """Cells of a box of about the size ``h`` [m]."""
    return Grid.counts(tuple(box.size), h)


def down(dim: int, slope: float) -> Tuple[float, ...]:
    """Gravity in the frame of a chute that falls along x by ``slope`` [degrees] [m/s^2]."""
    angle = np.radians(slope)
    return (9.81 * float(np.sin(angle)), -9.81 * float(np.cos(angle)), 0.0)[:dim]


def chute(box: Box, width: float, gate: float, friction: float) -> List[Structure]:
    """The part inside ``box`` of a chute: its bed y = 0 with ``friction``, a gate x = 0 that reaches ``gate``
    [m] down it, and in space smooth sides, ``width`` [m] apart."""
    dim, zero = box.dim, (0.0,) * box.dim
    planes = [Structure.plane("bed", zero, "+y", box, friction=friction),
              Structure.plane("gate", zero, "+x", Box(box.lower, (gate, *box.upper[1:])))]
    sides = ("left", 0.0, "+z"), ("right", width, "-z")
    return planes + [Structure.plane(name, (0.0, 0.0, z), normal, box) for name, z, normal in sides
                     if dim == 3]


def pebble(seed: int, corners: int = 24) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices, shape (n, 3), and triangles of a convex stone about as large as a ball of radius 1, longer
    than thick."""
    from scipy.spatial import ConvexHull  # slow to import, and few scenes need it

    x = np.random.default_rng(seed).normal(size=(corners, 3))
    x *= np.array([1.2, 0.8, 1.0]) / np.linalg.norm(x, axis=1)[:, None]
    hull = ConvexHull(x)
    outwards = np.einsum("ti,ti->t", np.cross(x[hull.simplices[:, 1]] - x[hull.simplices[:, 0]],
                                              x[hull.simplices[:, 2]] - x[hull.simplices[:, 0]]),
                         hull.equations[:, :3]) > 0.0
    return x, np.where(outwards[:, None], hull.simplices, hull.simplices[:, ::-1])


def force(history: Any, matter: str, names: Tuple[str, ...]) -> np.ndarray:
    """Sum of the forces of "soil" or "rock" along x on the regions of those ``names`` [N], shape (windows,);
    zero where there are no such columns."""
    columns = [f"force_{matter}_{name}_x" for name in names]
    return sum((history[c] for c in columns if c in history.columns), np.zeros(len(history["time"])))


MEAN = 0.02  # [s]


def draw(path: Path, histories: Dict[str, History], names: Tuple[str, ...]) -> None:
    """Force of soil and rocks on the force cells ``names`` of a barrier, beside that of a jet like the flow
    before it, on each of them, and the impulse. Forces thick: means over the last ``MEAN`` s, thin: of
    each window."""
    panels: Dict[str, list] = {"force on the barrier [N]": [], "force on each cell [N]": [],
                               "impulse on the barrier [N s]": []}
    first, cells, impulse = panels.values()
    for name, history in histories.items():
        t, told = history["time"], f" ({name})" if len(histories) > 1 else ""
        soil, rock = (force(history, matter, names) for matter in ("soil", "rock"))
        shown = {"soil": soil, "rocks": rock} if rock.any() else {"soil": soil}
        each = {cell: force(history, "soil", (cell,)) + force(history, "rock", (cell,)) for cell in names}
        for panel, parts in (first, shown), (cells, each):
            for label, values in parts.items():
                mean = figure.mean_over(t, history["window"], values, MEAN)
                panel.append((t, mean, f"{label}, mean of {1e3 * MEAN:.0f} ms{told}", "run"))
                panel.append((t, values, "", "thin"))
        first.append((t, history["front_force"], f"ρ v² h w{told}", "reference"))
        for label, values in {**shown, "together": soil + rock}.items() if rock.any() else shown.items():
            impulse.append((t, np.cumsum(values * history["window"]), f"{label}{told}", "run"))
    figure.draw(path, "time [s]", panels)


BEFORE = 0.1, 0.25  # where the flow is looked at, before the barrier [m]


def front(solid: Any, at: float, width: float) -> Dict[str, tuple]:
    """Columns of the flow before a barrier at ``at`` [m] along x: mean speed, depth over the ``width`` [m],
    and the force of a jet like that which is stopped."""
    low, high = at - BEFORE[1], at - BEFORE[0]

    def jet() -> np.ndarray:
        p = solid.bodies[0].points
        near = (p.x[:, 0] > low) & (p.x[:, 0] < high)
        volume = p.V0[near] * np.linalg.det(p.F[near])
        sums = np.array([p.mass[near].sum(), p.mass[near] @ p.v[near, 0], volume.sum()])
        mass, momentum, volume = solid.comm.allreduce(sums)
        speed = momentum / mass if mass else 0.0
        return np.array([speed, volume / (width * (high - low)), mass / (high - low) * speed * abs(speed)])

    where = f"of the soil from {BEFORE[1]} to {BEFORE[0]} m before the barrier"
    return {"front_speed": ("m/s", f"mean speed {where}", lambda window: jet()[0]),
            "front_depth": ("m", f"depth {where}", lambda window: jet()[1]),
            "front_force": ("N", f"rho v^2 h w, force of a jet {where} that is stopped",
                            lambda window: jet()[2])}
