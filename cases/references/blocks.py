"""What ``granular_blocks`` tells of its blocks: columns of the history, events beside those of the paper,
figure."""
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np
from mpi4py import MPI

from coupling import History
from coupling.pictures import figure
from dem_liggghts import quaternion

# name → meaning, the paper's number, that of the experiment of Liu et al. 2018, which it cites; times [s],
# places [m] from the left wall, angles [degrees] clockwise; None where none is given
EVENTS = {
    "arrival": ("the soil touches a block", 0.25, 0.25),
    "floor2": ("the second block touches the floor", 0.365, None),
    "quarter2": ("it has turned by 90 degrees", 0.40, None),
    "left2": ("its left face at 0.46 s", 0.345, 0.346),
    "left2_end": ("its left face at the end", 0.345, 0.346),
    "floor3": ("the top block touches the floor", 0.385, None),
    "left3": ("its left face at 0.46 s", 0.397, 0.401),
    "left3_end": ("its left face at the end", 0.397, 0.401),
    "angle3": ("it has turned by, at 0.45 s", 180.0, 180.0),
    "angle3_end": ("it has turned by, at the end", 180.0, 180.0),
    "deepest": ("deepest material point in a block", None, None),
    "inside": ("most material points in blocks", None, None)}


class BlockGauges:
    """Place and rotation of the blocks, the force of the soil on them and the material points inside;
    observer of a run. block: width and height of one [m]; known: whether the scene is that of the paper.
    Collective."""

    def __init__(self, solid: Any, grains: Any, block: Tuple[float, float], known: bool):
        self._solid, self._grains, self._half, self._known = solid, grains, 0.5 * np.array(block), known
        self._bodies = grains.bodies()
        self.now: Dict[str, float] = {}
        self._angle = np.zeros(len(self._bodies))

    def columns(self) -> dict:
        """For the record of the run."""
        shown = {"push": ("N", "force of the soil on the blocks to the right, mean over the window"),
                 "lift": ("N", "force of the soil on the blocks upwards, mean over the window")}
        for k in range(2, len(self._angle) + 1):
            shown |= {f"left{k}": ("m", f"smallest x of the corners of block {k} (1 is the lowest)"),
                      f"angle{k}": ("degrees", f"rotation of block {k}, clockwise"),
                      f"low{k}": ("m", f"height of the spheres of block {k} over the floor")}
        shown |= {"deepest": ("m", "how far a material point is inside a block"),
                  "inside": ("1", "number of material points inside blocks")}
        return {name: (*meaning, lambda _, name=name: self.now[name]) for name, meaning in shown.items()}

    def __call__(self, window: Any) -> None:
        """Read all gauges."""
        self._bodies = self._grains.bodies()
        turned = np.degrees(-quaternion.angle(self._bodies["quaternion"]))
        self._angle += (turned - self._angle + 180.0) % 360.0 - 180.0  # goes on beyond a whole turn
        spheres, corners = window.particles, self.shapes()
        self.now = dict(zip(("push", "lift"), 0.0 - window.wall_force.sum(axis=0)))
        for k in range(1, len(self._angle)):
            own = spheres[spheres["body"] == k + 1]
            self.now |= {f"left{k + 1}": corners[k, :, 0].min(), f"angle{k + 1}": self._angle[k],
                         f"low{k + 1}": (own["x"][:, 1] - own["radius"]).min()}
        self.now["deepest"], self.now["inside"] = self._intruders()

    def get_state(self) -> np.ndarray:
        """Rotation of the blocks so far [degrees], shape (blocks,), for checkpoints."""
        return self._angle.copy()

    def set_state(self, state: np.ndarray) -> None:
        """The counterpart."""
        self._angle, self._bodies = state.copy(), self._grains.bodies()

    def shapes(self) -> np.ndarray:
        """Corners of all blocks [m], shape (blocks, 4, 2), for pictures."""
        angle = -np.radians(self._angle)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        around = self._half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        return self._bodies["x"][:, None, :2] + np.einsum("ijb,cj->bci", turn, around)

    def _intruders(self) -> Tuple[float, int]:
        """Depth of the deepest material point inside a block [m] and the number of those inside."""
        x, deepest, inside = self._solid.points.x, 0.0, 0
        x = x[x[:, 0] > self._bodies["x"][:, 0].min() - 2.0 * self._half.max()]  # the rest is far away
        for place, angle in zip(self._bodies["x"][:, :2], np.radians(self._angle)):
            near = x[np.abs(x - place).max(axis=1) < 2.0 * self._half.max()] - place
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            depth = (self._half - np.abs(near @ turn)).min(axis=1)
            deepest, inside = max(deepest, depth.max(initial=0.0)), inside + np.count_nonzero(depth > 0.0)
        comm = self._solid.comm
        return comm.allreduce(deepest, MPI.MAX), comm.allreduce(inside)

    def entries(self, history: History) -> dict:
        """For the report of the run."""
        return {"events": events(history, len(self._angle), self._known)}


def events(history: History, blocks: int, known: bool) -> dict:
    """What the paper tells of the blocks: name → dict of ``meaning``, ``here``, ``paper``, ``experiment``;
    None for what has not happened, and where the scene is not ``known`` as that of the paper."""
    t = history["time"]
    first = lambda mask: float(t[np.argmax(mask)]) if mask.any() else None
    at = lambda name, time: float(np.interp(time, t, history[name])) if t[-1] >= time else None
    here = {"arrival": first(np.abs(history["push"]) + np.abs(history["lift"]) > 0),
            "deepest": float(history["deepest"].max()), "inside": float(history["inside"].max())}
    for k in range(2, min(blocks, 3) + 1):
        here |= {f"floor{k}": first(history[f"low{k}"] < 0.0), f"left{k}": at(f"left{k}", 0.46),
                 f"left{k}_end": float(history[f"left{k}"][-1]), f"angle{k}": at(f"angle{k}", 0.45),
                 f"angle{k}_end": float(history[f"angle{k}"][-1])}
    if blocks > 1:
        here["quarter2"] = first(history["angle2"] >= 89.0)  # those that lie on the floor sink in a little
    return {name: dict(meaning=meaning, here=here[name], paper=paper if known else None,
                       experiment=experiment if known else None)
            for name, (meaning, paper, experiment) in EVENTS.items() if name in here}


def errors(histories: Dict[str, History], blocks: int, known: bool) -> dict:
    """Differences to the paper of the ``events`` of the last history, and the largest one in rotation between
    back ends."""
    *others, history = histories.values()
    found = {name: event["here"] - event["paper"] for name, event in events(history, blocks, known).items()
             if None not in (event["here"], event["paper"])}
    for name in ("angle2", "angle3"):
        if others and name in history.columns:
            found[f"back_ends_{name}"] = float(np.abs(others[0][name] - history[name]).max())
    return found


def draw(path: Path, histories: Dict[str, History], blocks: int) -> None:
    """The paper's figure 11, rotation of the blocks over time, with fronts and energies below it."""
    turns: list = []
    places, energies, (*_, last) = [], [], histories
    for backend, history in histories.items():
        t, style = history["time"], "run" if backend == last else "under"
        name = "" if len(histories) == 1 else f", {'LIGGGHTS' if backend == 'liggghts' else 'built-in DEM'}"
        for k in range(2, blocks + 1):
            turns.append((t, history[f"angle{k}"], f"block {k}{name}", style))
            places.append((t, 100 * history[f"left{k}"], f"block {k}{name}", style))
        places.append((t, 100 * history["x99"], f"99 % of the soil{name}", style))
        energies += [(t, history[key], f"{key}{name}", style) for key in ("potential", "kinetic", "elastic")]
        energies.append((t, history["energy_grains"], f"blocks{name}", style))
    for time, angle in ((0.40, 90.0), (0.45, 180.0)):
        text = "paper: 90 degrees at 0.40 s, 180 at 0.45 s" if angle == 90.0 else None
        turns.append((np.array([-0.015, 0.015]) + time, np.array([angle, angle]), text, "reference"))
    panels = {"rotation, clockwise [degrees]": turns, "left face, front [cm]": places, "energy [J]": energies}
    figure.draw(path, "time [s]", panels)
