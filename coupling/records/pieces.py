"""What the ParaView series show besides the solid's own: particles and wall of the grains, rocks, structures,
fixed walls and the forces where soil and particles touch."""
from typing import Any, Dict, List, Optional

import numpy as np

from ..loop.window import Window
from ..protocols import RecordedGrains, RecordedSolid
from ..shapes import fixed_walls, has_surface, joined, motion_of, placed, rocks, sizes, structures
from .paraview import Piece

KIND = {1: "vertex", 2: "line", 3: "triangle"}  # by number of corners
SIDES = "soil", "rock"  # which push structures: the solid, the grains


class Pieces:
    """Parts of ``ParaView.add`` at one time after the other. Forces on structures are means since the time
    before: sums of them lose nothing between two files. ground: a terrain, or None; shaken:
    what stands still is shown at each time. Collective."""

    def __init__(self, solid: RecordedSolid, grains: Optional[RecordedGrains], ground: Any = None,
                 shaken: bool = False) -> None:
        self._shaken = shaken
        self._ground: Any = ground if hasattr(ground, "elements") else None
        self._ground_moves = motion_of(self._ground, solid, grains)
        self._solid, self._grains, self._structures = solid, grains, structures(solid, grains)
        self._walls_shown, self._time = False, solid.time
        self._impulses: List[Dict[str, np.ndarray]] = []

    def __call__(self, time: float, window: Optional[Window]) -> Dict[str, Piece]:
        """At a ``time`` [s], the end of a ``Window``, or at the start for None."""
        parts: Dict[str, Piece] = {}
        if self._grains is not None:
            parts.update(particles_and_wall(self._grains, window))
            parts.update(_rocks(self._grains))
            parts.update(_touching(self._grains))
        if self._structures:
            parts["structures"] = self._on_structures(time)
        walls = fixed_walls(self._solid, self._grains)
        if walls and not self._walls_shown:  # at rest: one file is enough
            dim = walls[0].nodes.shape[1]
            faces = joined([(wall.nodes, wall.elements) for wall in walls], dim)
            parts["walls"] = faces.x, {KIND[dim]: faces.elements}, {}, {"wall": faces.of_element}
        if self._ground is not None and (self._ground_moves or not self._walls_shown):
            parts["terrain"] = self._terrain(time)
        self._walls_shown = not self._shaken
        return parts

    def _terrain(self, time: float) -> Piece:
        """Where it is; one that moves as a structure says by how much it has."""
        x, elements = (np.asarray(part) for part in (self._ground.x, self._ground.elements))
        if self._ground_moves is None:
            return x, {KIND[x.shape[1]]: elements}, {"height": x[:, -1]}
        shift = np.broadcast_to(np.asarray(self._ground_moves(time), float), x.shape)
        moved = x + shift
        return moved, {KIND[x.shape[1]]: elements}, {"height": moved[:, -1], "displacement": shift}

    def _on_structures(self, time: float) -> Piece:
        """All structures where they are, with the forces on their force cells."""
        parts = [(placed(one, time), one.elements) for one in self._structures]
        dim = parts[0][0].shape[1]
        faces = joined(parts, dim)
        names = [name for one in self._structures for name in one.cells]
        first = np.cumsum([0, *(len(one.cells) for one in self._structures)])
        cell = np.concatenate([f + (np.zeros(len(one.elements), int) if one.cell is None else one.cell)
                               for f, one in zip(first, self._structures)])
        data: Dict[str, Any] = {"structure": faces.of_element, "cell": cell}
        area = np.bincount(cell, sizes(faces.x, faces.elements), minlength=len(names))
        for side, force in self._forces(time, names, dim).items():
            data[f"force_{side}"] = force[cell]
            data[f"traction_{side}"] = (force / area[:, None])[cell]
        shift = faces.x - np.concatenate([np.asarray(one.x, float) for one in self._structures])
        return faces.x, {KIND[dim]: faces.elements}, {"displacement": shift}, data

    def _forces(self, time: float, names: List[str], dim: int) -> Dict[str, np.ndarray]:
        """By side the mean forces on the force cells ``names`` [N], shape (cells, dim), since the time
        before."""
        sides: Any = (self._solid, self._grains)
        now: List[Dict[str, np.ndarray]] = [getattr(side, "impulses", dict)() for side in sides]
        before, span = self._impulses or now, time - self._time
        forces = {}
        for side, old, new in zip(SIDES, before, now):
            if any(name in new for name in names):
                nothing = np.zeros(dim)
                change = [new.get(name, nothing)[:dim] - old.get(name, nothing)[:dim] for name in names]
                forces[side] = -np.array(change) / (span if span > 0.0 else 1.0)
        self._impulses, self._time = now, time
        return forces

    def get_state(self) -> Dict[str, Any]:
        """What the next times go on from, as plain data."""
        return {"walls_shown": self._walls_shown, "time": self._time,
                "impulses": [{name: value.copy() for name, value in side.items()} for side in self._impulses]}

    def set_state(self, state: Dict[str, Any]) -> None:
        """The counterpart."""
        self._walls_shown, self._time = bool(state["walls_shown"]), float(state["time"])
        self._impulses = [dict(side) for side in state["impulses"]]


def particles_and_wall(grains: RecordedGrains, window: Optional[Window]) -> Dict[str, Piece]:
    """The particles now, the wall at the end of a ``Window``, or at the start for None, and the nodes of the
    wall that are pushed. Collective."""
    particles, wall = grains.particles(), grains.scene.wall
    kind = KIND[np.shape(wall.elements)[1]]
    x, v, force = wall.nodes, np.zeros_like(wall.nodes), np.zeros_like(wall.nodes)
    if window is not None:
        x, v, force = window.wall_x + window.dt * window.wall_v, window.wall_v, window.wall_force
    data = {"velocity": particles["v"], "spin": particles["omega"], "radius": particles["radius"],
            "mass": particles["mass"], **({"body": particles["body"]} if grains.scene.clusters else {})}
    parts: Dict[str, Piece] = {"particles": (particles["x"], _vertices(len(particles)), data)}
    if not len(x):  # readers refuse files without points
        return parts
    pushed = np.flatnonzero((force != 0.0).any(axis=1))
    pushed = pushed if len(pushed) else np.zeros(1, int)  # a node without force
    return {**parts, "wall": (x, {kind: wall.elements}, {"velocity": v, "force": force}),
            "contacts": (x[pushed], _vertices(len(pushed)), {"force": force[pushed]})}


def _rocks(grains: RecordedGrains) -> Dict[str, Piece]:
    """The surfaces of the clusters that have one, with the velocity of each vertex. Collective."""
    if not any(map(has_surface, getattr(grains.scene, "clusters", ()))):
        return {}
    faces, bodies = rocks(grains)
    own = bodies[faces.of_vertex]
    velocity = own["v"] + np.cross(own["omega"], faces.x - own["x"])
    whole = bodies[faces.of_element]
    return {"rocks": (faces.x, {"triangle": faces.elements}, {"velocity": velocity},
                      {"body": whole["id"], "mass": whole["mass"], "velocity_of_centre": whole["v"],
                       "spin": whole["omega"]})}


def _touching(grains: RecordedGrains) -> Dict[str, Piece]:
    """The contacts of particles with each other and with walls, where there are any. Collective."""
    if not hasattr(grains, "contact_points"):
        return {}
    found = grains.contact_points()
    if not len(found):
        return {}
    names = "force", "particle", "other", "wall", "overlap"
    return {"particle_contacts": (found["x"], _vertices(len(found)), {name: found[name] for name in names})}


def _vertices(count: int) -> Dict[str, np.ndarray]:
    return {"vertex": np.arange(count)[:, None]}
