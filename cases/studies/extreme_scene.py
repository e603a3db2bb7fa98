"""Scenes of ``extreme.py``: body, grid, supports, interface and spheres."""
from typing import List, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Mapping, indentation_compliance, linear, spread
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Interface, Support, seed
from mpm_fenicsx.laws import Law
from studies import extreme_references as known
from studies.extreme_keys import ALONE, Extreme


def make_solid(p: Extreme, interface: Interface) -> MPM:
    """Background grid, bodies and supports. The origin is in the middle of the body's upper side. p: in SI
    units."""
    box, law = box_of(p), LAWS[p.block.law]
    (lower, upper), boxes, laws = (box.lower, box.upper), [box], [law(p.block.E, p.block.nu)]
    if p.scene == "layers":
        height = p.block.height
        boxes.append(Box((lower[0], -2 * height, *lower[2:]), (upper[0], -height, *upper[2:])))
        laws.append(law(p.block.E / p.block.contrast, p.block.nu))
    grid, counts = background(p, boxes)
    held = boxes[-1].lower[1] + 1e-6 * p.block.height
    supports = {"free": [], "flight": [],
                "beam": [Support.column("x", end, grid, "y") for end in (lower[0], upper[0])],
                "block": [Support(lambda x: x[:, 1] < held, "xyz"[:p.dim], name="support of the bottom")]}
    supports |= {"swing": supports["beam"], "layers": supports["block"], "rest": supports["block"]}
    bodies = [body(p, *part, counts) for part in zip(boxes, laws)]
    return MPM(grid, bodies, supports[p.scene], interface, inertia=p.resolution.inertia,
               bonded=True, numerics=p.numerics)


def box_of(p: Extreme) -> Box:
    """Place of the body."""
    block = p.block
    return Box((-block.length / 2, -block.height, -block.width / 2)[:p.dim],
               (block.length / 2, 0.0, block.width / 2)[:p.dim])


def cells_of(p: Extreme, box: Box) -> np.ndarray:
    """Of about ``h`` along each side of the body, shape (dim,)."""
    return np.maximum(np.rint(box.size / p.resolution.h), 1).astype(int)


def background(p: Extreme, boxes: List[Box]) -> Tuple[Grid, np.ndarray]:
    """Grid with cells of about ``h`` that fit the boxes, two more on each side, more where the body flies,
    and cells of a box."""
    counts = cells_of(p, boxes[0])
    h = boxes[0].size / counts
    around = np.full((2, p.dim), 2)
    if p.scene in ("free", "flight"):
        windows, v0, fly = p.windows.windows, p.ball.v0, p.block.fly
        travel = windows * p.dt * np.array([abs(fly) + v0, 2 * v0, 0.0][:p.dim])
        n = np.prod(counts + 2 * travel / h)
        what = f"{n:.3g} cells of the grid for a flight of {travel.max():.3g} m"
        check.check_memory(f"{what} (windows={windows}, v0={v0:g}, fly={fly:g})", 600 * n,
                           "take fewer windows or a smaller speed")
        around += np.ceil(travel / h + 1).astype(int)
    around[0, 1] += (len(boxes) - 1) * counts[1]
    return Grid(Box(tuple(boxes[0].lower - around[0] * h), tuple(boxes[0].upper + around[1] * h)),
                counts + around.sum(axis=0), p.resolution.cell), counts


def body(p: Extreme, box: Box, law: Law, counts: np.ndarray) -> Body:
    """One block with its points seeded as ``seeding`` says."""
    fine, state = p.resolution, f"plane_{p.block.plane}" if p.dim == 2 else None
    whole = Body(box, tuple(fine.refine * counts), fine.points, law, p.block.rho, state,
                 p.block.width if p.dim == 2 else 1.0, fine.cell, known.start(p), fine.f_bar)
    if fine.seeding == "gauss":
        return whole
    x, volume = seed(whole)
    volume = volume / whole.thickness
    if fine.seeding == "random":
        x = np.random.default_rng(1).uniform(box.lower, box.upper, x.shape)
        volume[:] = volume.mean()
    else:
        corner = np.array(box.upper)
        corner[0] += 1e-3 * fine.h
        corner[1:] -= 1e-3 * fine.h
        x, volume = np.vstack([x, corner]), np.append(volume, volume[-1])
    return Body(Cloud(x, volume), None, None, law, p.block.rho, state, whole.thickness, fine.cell,
                whole.velocity, fine.f_bar)


def interface_on(p: Extreme) -> Interface:
    """Boundary particles, two per cell, on the body's upper side, and on its flanks where it is free."""
    box = box_of(p)
    counts = cells_of(p, box)
    across = [2 * counts[d] for d in range(p.dim) if d != 1]
    if p.scene != "free" or p.dim == 3:
        top = Interface.top(box, across)
        return Interface(top.x - [0.0, p.resolution.shift, 0.0][:p.dim], top.elements)
    (x0, y0), (x1, y1) = box.lower, box.upper
    up, along = 2 * counts[1], across[0]
    left, middle, right = (Interface.line(a, b, n).x for a, b, n in (
        ((x0, y0), (x0, y1), up), ((x0, y1), (x1, y1), along), ((x1, y1), (x1, y0), up)))
    x = np.concatenate([left, middle[1:-1], right])
    i = np.arange(len(x) - 1)
    return Interface(x, np.column_stack([i, i + 1]))


def make_grains(p: Extreme, interface: Interface) -> Scene:
    """Spheres above the body, and the interface as their wall."""
    wall, steel = Wall(interface.x, interface.elements), Material(p.block.E, p.block.nu)
    if p.scene in ALONE:
        return Scene(Spheres.none(p.dim), wall, steel, steel)
    ball, angle = p.ball, np.radians(p.ball.angle)
    beyond = np.maximum(np.abs(ball.at) - p.block.length / 2, 0.0)  # of an edge: the sphere lies around it
    x = np.zeros((len(ball.at), p.dim))
    x[:, 0], x[:, 1] = ball.at, np.sqrt((ball.radius + ball.gap) ** 2 - beyond**2) - p.resolution.shift
    v = np.zeros_like(x)
    v[:, :2] = ball.v0 * np.sin(angle), -ball.v0 * np.cos(angle)
    if p.scene == "rest":
        v[:] = 0.0
    return Scene(Spheres(x, v, ball.radius, p.density), wall, Material(p.E_ball, p.block.nu), steel,
                 at_wall=Interaction(ball.restitution, ball.friction),
                 gravity=(0.0, -ball.gravity, 0.0)[:p.dim])


def make_mapping(p: Extreme, interface: Interface) -> Mapping:
    """The wall follows the interface; the force is spread where that is asked for."""
    radius, block = p.ball.spread, p.block
    width = block.width if p.dim == 2 else None
    left = indentation_compliance(radius, block.E, block.nu, width, block.plane) if p.ball.take_out else 0.0
    return spread(linear(interface.x, interface.elements, interface.x), radius, left)
