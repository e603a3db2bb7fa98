"""Flows down a chute against a barrier: rocks for them, the figure of the force, and what a jet would exert."""
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np

from coupling import History
from coupling.pictures import figure


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
    return sum((history[c] for c in columns if c in history), np.zeros(len(history["time"])))


def draw(path: Path, histories: Dict[str, History], names: Tuple[str, ...], jet: float = 0.0) -> None:
    """Force of soil and rocks on the force cells ``names`` of a barrier, on each of them, and its impulse.
    jet: a force [N] to compare with, drawn thin when it is not zero."""
    panels: Dict[str, list] = {"force on the barrier [N]": [], "force on each cell [N]": [],
                               "impulse [N s]": []}
    first, cells, impulse = panels.values()
    for name, history in histories.items():
        t, told = history["time"], f" ({name})" if len(histories) > 1 else ""
        soil, rock = (force(history, matter, names) for matter in ("soil", "rock"))
        first += [(t, soil, f"soil{told}", "run")] + [(t, rock, f"rocks{told}", "run")] * bool(rock.any())
        cells += [(t, force(history, "soil", (cell,)) + force(history, "rock", (cell,)), f"{cell}{told}", "run")
                  for cell in names]
        impulse.append((t, np.cumsum((soil + rock) * history["window"]), f"both{told}", "run"))
        if jet:
            first.append((t[[0, -1]], [jet, jet], "ρ v² h w", "reference"))
    figure.draw(path, "time [s]", panels)


def front(solid: Any, at: float, width: float) -> Any:
    """Observer's columns: speed and depth of the soil within 0.1 m before ``at`` [m] along x, and the force ρ
    v² h w of a jet of that ``width`` [m] that is stopped there."""
    def jet() -> Tuple[float, float, float]:
        lots = [(p.x, p.v, p.mass, p.volume_now) for p in map(_seen, solid.bodies[:1])]
        x, v, mass, volume = lots[0]
        near = (x[:, 0] > at - 0.1) & (x[:, 0] < at)
        sums = np.array([mass[near].sum(), mass[near] @ v[near, 0], volume[near].sum()])
        sums = sums if solid.comm.size == 1 else solid.comm.allreduce(sums)
        speed = sums[1] / sums[0] if sums[0] else 0.0
        return speed, sums[2] / (0.1 * width), sums[0] / 0.1 * speed * abs(speed)

    return {"front_speed": ("m/s", "of the soil up to 0.1 m before the barrier", lambda w: jet()[0]),
            "front_depth": ("m", "of the soil there", lambda w: jet()[1]),
            "front_force": ("N", "rho v^2 h w of a jet with them", lambda w: jet()[2])}


def _seen(body: Any) -> Any:
    p = body.points
    p.volume_now = p.V0 * np.linalg.det(p.F)
    return p
