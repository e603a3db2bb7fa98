"""What ``granular_blocks`` tells of its blocks: columns of the history, events beside those of the paper, figures."""
import numpy as np
from column_collapse import Flow
from mpi4py import MPI

from coupling.pictures import animation, figure, frames
from dem_liggghts import quaternion

PLACE = dict(at=0.30, blocks=3, block=(0.02, 0.018), height=0.20, width=0.10)  # keys of the scene of the paper

# name → meaning, the paper's number, that of the experiment of Liu et al. 2018, which it cites; times [s], places [m]
# from the left wall, angles [degrees] clockwise; None where none is given
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


class Obstacles(Flow):
    """The flow of the soil and the blocks that it meets, window by window: an observer to be called before the
    ``Record``. Collective."""

    def __init__(self, solid, grains, p):
        self._grains, self._half, self._angle = grains, 0.5 * np.array(p.block), np.zeros(p.blocks)
        self._every, self._movie, self._shapes, self._dt = p.animation, [], [], p.dt
        super().__init__(solid, p)

    def columns(self):
        """For the ``Record``."""
        shown = {"push": ("N", "force of the soil on the blocks to the right, mean over the window"),
                 "lift": ("N", "force of the soil on the blocks upwards, mean over the window")}
        for k in range(2, len(self._angle) + 1):
            shown |= {f"left{k}": ("m", f"smallest x of the corners of block {k} (1 is the lowest)"),
                      f"angle{k}": ("degrees", f"rotation of block {k}, clockwise"),
                      f"low{k}": ("m", f"height of the spheres of block {k} over the floor")}
        shown |= {"deepest": ("m", "how far a material point is inside a block"),
                  "inside": ("1", "number of material points inside blocks")}
        return {**super().columns(), **{name: (*meaning, lambda _, name=name: self.now[name])
                                        for name, meaning in shown.items()}}

    def __call__(self, window):
        self._bodies = self._grains.bodies()
        turned = np.degrees(-quaternion.angle(self._bodies["quaternion"]))
        self._angle += (turned - self._angle + 180.0) % 360.0 - 180.0  # goes on beyond a whole turn
        super().__call__(window)
        spheres, corners = window.particles, self._corners()
        self.now |= dict(zip(("push", "lift"), 0.0 - window.wall_force.sum(axis=0)))
        for k in range(1, len(self._angle)):
            own = spheres[spheres["body"] == k + 1]
            self.now |= {f"left{k + 1}": corners[k, :, 0].min(), f"angle{k + 1}": self._angle[k],
                         f"low{k + 1}": (own["x"][:, 1] - own["radius"]).min()}
        self.now["deepest"], self.now["inside"] = self._intruders()
        if self._every and window.number % self._every == 0:
            x, speed = self._gathered()
            self._movie.append((f"t = {window.time:.3f} s", x.copy(), speed, corners))

    def _corners(self):
        """Of all blocks [m], shape (blocks, 4, 2)."""
        angle = -np.radians(self._angle)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        around = self._half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        return self._bodies["x"][:, None, :2] + np.einsum("ijb,cj->bci", turn, around)

    def _intruders(self):
        """Depth of the deepest material point inside a block [m] and the number of those inside."""
        x, deepest, inside = self._solid.points.x, 0.0, 0
        x = x[x[:, 0] > self._bodies["x"][:, 0].min() - 2.0 * self._half.max()]  # most of the soil is far away
        for place, angle in zip(self._bodies["x"][:, :2], np.radians(self._angle)):
            near = x[np.abs(x - place).max(axis=1) < 2.0 * self._half.max()] - place
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            depth = (self._half - np.abs(near @ turn)).min(axis=1)
            deepest, inside = max(deepest, depth.max(initial=0.0)), inside + np.count_nonzero(depth > 0.0)
        comm = self._solid.comm
        return comm.allreduce(deepest, MPI.MAX), comm.allreduce(inside)

    def _picture(self, time):
        self._bodies = self._grains.bodies()
        super()._picture(time)
        self._shapes.append(self._corners())

    def pictures(self, name):
        """Of the points by speed with the blocks, and the animation where one is asked for."""
        still = {f"{name}.png": lambda path: frames.draw(path, self._frames, "speed [m/s]", self._shapes)}
        return still if not self._every else {
            **still, f"{name}.gif": lambda path: self._movie and animation.save(path, self._movie, "speed [m/s]")}


def events(history, p):
    """What the paper tells of the blocks: name → dict of ``meaning``, ``here``, ``paper``, ``experiment``; None for
    what has not happened or is not known."""
    t = history["time"]
    first = lambda mask: float(t[np.argmax(mask)]) if mask.any() else None  # noqa: E731
    at = lambda name, time: float(np.interp(time, t, history[name])) if t[-1] >= time else None  # noqa: E731
    here = {"arrival": first(np.abs(history["push"]) + np.abs(history["lift"]) > 0),
            "deepest": float(history["deepest"].max()), "inside": float(history["inside"].max())}
    for k in range(2, min(p.blocks, 3) + 1):
        here |= {f"floor{k}": first(history[f"low{k}"] < 0.0), f"left{k}": at(f"left{k}", 0.46),
                 f"left{k}_end": float(history[f"left{k}"][-1]), f"angle{k}": at(f"angle{k}", 0.45),
                 f"angle{k}_end": float(history[f"angle{k}"][-1])}
    if p.blocks > 1:
        here["quarter2"] = first(history["angle2"] >= 89.0)  # the spheres that lie on the floor sink in a little
    known = all(getattr(p, key) == value for key, value in PLACE.items())
    return {name: dict(meaning=meaning, here=here[name], paper=paper if known else None,
                       experiment=experiment if known else None)
            for name, (meaning, paper, experiment) in EVENTS.items() if name in here}


def miss(table, runs):
    """Differences to the paper of the ``events``, and the largest one in rotation between back ends, for the report."""
    errors = {name: event["here"] - event["paper"] for name, event in table.items()
              if None not in (event["here"], event["paper"])}
    *others, history = runs.values()
    for name in ("angle2", "angle3"):
        if others and name in history.columns:
            errors[f"back_ends_{name}"] = float(np.abs(others[0][name] - history[name]).max())
    return errors


def draw(path, runs, p):
    """The paper's figure 11, rotation of the blocks over time, with fronts and energies below it."""
    panels, (*_, last) = {"rotation, clockwise [degrees]": [], "left face, front [cm]": [], "energy [J]": []}, runs
    turns, places, energies = panels.values()
    for backend, history in runs.items():
        t, style = history["time"], "run" if backend == last else "under"
        name = "" if len(runs) == 1 else f", {'LIGGGHTS' if backend == 'liggghts' else 'built-in DEM'}"
        for k in range(2, p.blocks + 1):
            turns.append((t, history[f"angle{k}"], f"block {k}{name}", style))
            places.append((t, 100 * history[f"left{k}"], f"block {k}{name}", style))
        places.append((t, 100 * history["x99"], f"99 % of the soil{name}", style))
        energies += [(t, history[key], f"{key}{name}", style) for key in ("potential", "kinetic", "elastic")]
        energies.append((t, history["energy_grains"], f"blocks{name}", style))
    for time, angle, text in ((0.40, 90.0, "paper: 90 degrees at 0.40 s, 180 at 0.45 s"), (0.45, 180.0, None)):
        turns.append((np.array([-0.015, 0.015]) + time, np.array([angle, angle]), text, "reference"))
    figure.draw(path, "time [s]", panels)
