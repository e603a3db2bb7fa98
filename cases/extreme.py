"""A sphere and an elastic block in stiff and extreme conditions, each against what must come out: the rows of the
stability matrix (``studies/matrix.py``).

    python cases/extreme.py                                       a steel sphere on a beam
    python cases/extreme.py scene=free mass_ratio=1e3             a heavy sphere strikes a body that flies away
    python cases/extreme.py scene=rest windows=10000              a sphere lies on a block, under its weight
    python cases/extreme.py unit=1e-6,1e-3,1e-9                   the beam in micrometres, milliseconds, micrograms

Scenes: ``beam``, supported at its ends; ``block``, held at its bottom; ``free``, held by nothing; ``layers``, a block
on another one of the modulus E / contrast, held at its bottom; ``rest``, the block with a sphere laid on it; ``swing``,
the beam alone in its first mode; ``flight``, the free block alone, flying and vibrating. ``extreme_references.py`` in
``studies`` says what each is compared with.
"""
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, Optional, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Record, cli, couple, linear, spread
from coupling.maps.spread import dent_in_plane, dent_in_space
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall, critical_step, open_dem
from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Interface, Support
from mpm_fenicsx.points.points import seed
from studies import extreme_references as references
from studies.extreme_keys import ALONE, check_keys

DIMENSION = {  # powers of length, time and mass in the keys that have any
    **dict.fromkeys(("length", "height", "width", "radius", "h", "shift", "gap", "at", "spread"), (1, 0, 0)),
    **dict.fromkeys(("v0", "fly"), (1, -1, 0)), **dict.fromkeys(("E", "E_ball"), (-1, -2, 1)), "rho": (-3, 0, 1),
    "gravity": (1, -2, 0), "dt": (0, 1, 0)}


def main(
    scene: Literal["beam", "block", "free", "layers", "rest", "swing", "flight"] = "beam",
    dim: Literal[2, 3] = 2,  # in the plane or in space
    length: float = 0.1535,  # of the body [m]
    height: float = 0.01,  # of the body [m]
    width: float = 0.01,  # of the body, across the plane [m]
    radius: float = 0.01,  # of the sphere [m]
    v0: float = 0.01,  # speed of the impact, or of the vibration of a body alone [m/s]
    angle: float = 0.0,  # of the impact, away from the vertical [deg]
    at: Tuple[float, ...] = (0.0,),  # places of the spheres along the body, 0: its middle [m]
    E: float = 215.82e9,  # Young's modulus of the body [Pa]
    E_ball: Optional[float] = None,  # of the sphere [Pa]; none: as the body
    contrast: float = 1.0,  # of the modulus over that of the layer below [-]
    nu: float = 0.289,  # Poisson's ratio of all [-]
    rho: float = 7960.0,  # density of the body [kg/m^3]
    mass_ratio: Optional[float] = None,  # mass of the sphere over that of the body [-]; none: of equal density
    law: Literal["linear", "neo_hooke"] = "linear",  # of the body
    plane: Literal["stress", "strain"] = "stress",  # plane state (dim=2)
    f_bar: bool = False,  # average the volume change over each cell
    h: float = 5e-3,  # size of the background cells [m]
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None,  # of grid and body
    refine: int = 1,  # body cells per background cell and direction [-]
    points: int = 3,  # material points per body cell: per direction, or in all for simplices [-]
    seeding: Literal["gauss", "random", "corner"] = "gauss",  # corner: one more point, alone in a corner of a cell
    shift: float = 0.0,  # of the interface into the body, negative: out of it [m]
    inertia: Literal["consistent", "lumped"] = "consistent",  # in the solve
    gravity: float = 0.0,  # on the spheres, downward [m/s^2]
    fly: float = 0.0,  # velocity of the body along the grid at the start [m/s]
    gap: float = 0.0,  # between sphere and body at the start [m]
    restitution: float = 1.0,  # of the contact [-]
    friction: float = 0.0,  # of the contact [-]
    spread: float = 0.0,  # radius over which the contact force is spread [m], docs/error_floor.md; 0: as it comes
    take_out: bool = False,  # the dent that is left under it, which Hertz's law contains
    dt: Optional[float] = None,  # coupling window [s]; none: by cfl or per_contact
    cfl: Optional[float] = None,  # coupling window over the explicit limit of the grid, h over the wave speed [-]
    per_contact: float = 50.0,  # coupling windows in the time of a Hertz contact [-]
    windows: int = 120,  # their number [-]
    iterate: int = 0,  # repetitions of a window, at most, until both sides agree [-]; 0: weak coupling
    adapt: Optional[float] = None,  # none: windows of one length; 0: shorter ones where one fails; see couple()
    substeps: Optional[int] = None,  # DEM steps per window [-]; none: of half the DEM's critical step
    unit: Tuple[float, float, float] = (1.0, 1.0, 1.0),  # in which the numbers above are given [m, s, kg]
    dem: Literal["reference", "liggghts"] = "reference",  # back end
    out: Path = Path("out/extreme"),  # folder of the results
) -> dict:
    """A sphere and an elastic block in extreme conditions, against conservation, kinematics, Hertz or the beam."""
    keys = dict(locals())
    check_keys(main, keys)
    p, other = prepare(keys), references.twin(keys)
    against = other and (prepare(other), run(other, prepare(other), f"{out}/twin")[0])
    return run(keys, p, out, against)[0]


def prepare(keys):
    """The keys in SI units, as a namespace, with what they leave open."""
    p = SimpleNamespace(**keys)
    for name, powers in DIMENSION.items():
        value, factor = getattr(p, name), float(np.prod(np.power(p.unit, powers)))
        if value is not None:
            setattr(p, name, tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value)
    p.E_ball = p.E if p.E_ball is None else p.E_ball
    p.mass = p.rho * p.length * p.height * p.width
    ball = 4 / 3 * np.pi * p.radius**3
    p.rho_ball = p.rho if p.mass_ratio is None else p.mass_ratio * p.mass / ball
    p.ball_mass = p.rho_ball * ball
    p.stiffness = 4 / 3 * np.sqrt(p.radius) / ((1 - p.nu**2) * (1 / p.E + 1 / p.E_ball))
    if p.scene not in ALONE and p.scene != "rest" and not references.approach(p) > 0:
        raise ValueError(f"angle is {p.angle} degrees: at={p.at[0]:g} is beyond an edge, and the sphere flies past, "
                         "give another one")
    if p.dt is None:
        wave = np.sqrt(p.E * (1 - p.nu) / ((1 + p.nu) * (1 - 2 * p.nu) * p.rho))
        p.dt = p.cfl * p.h / wave if p.cfl else references.contact_time(p) / p.per_contact
    return p


def run(keys, p, out, against=None):
    """One coupled run of the scene ``p``, of which ``keys`` are reported; its errors, see ``references.errors``."""
    grid, bodies, supports, interface = solid_scene(p)
    grains_scene = grains(p, interface)
    substeps = p.substeps or max(1, int(np.ceil(2 * p.dt / min(*critical_step(grains_scene), 1e6 * p.dt))))
    solid = MPM(grid, bodies, supports, interface, inertia=p.inertia, bonded=True)
    dem = open_dem(p.dem, grains_scene, p.dt / substeps)
    dent = 0.0 if not p.take_out else dent_in_space(p.spread, p.E, p.nu) if p.dim == 3 else \
        dent_in_plane(p.spread, references.moduli(p)[0], p.width)
    follow = spread(linear(interface.x, interface.elements, interface.x), p.spread, dent)
    with Record("extreme", {**keys, "dt": p.dt, "substeps": substeps}, out, solid, dem, windows=p.windows,
                columns=references.columns(p, solid), gravity=-p.gravity, closed=True) as record:
        couple(solid, dem, follow, dt=p.dt, t_end=p.windows * p.dt, substeps=substeps, iterate=p.iterate,
               adapt=p.adapt, on_window=[record])
        errors = references.errors(p, record.history, against)
        record.finish(errors)
    solid.close(), dem.close()
    return record.history, errors


def solid_scene(p):
    """Background grid, bodies, supports and interface: the body's upper side, and its flanks where it is free. The
    origin is in the middle of the upper side."""
    lower, upper = (-p.length / 2, -p.height, -p.width / 2)[:p.dim], (p.length / 2, 0.0, p.width / 2)[:p.dim]
    boxes, laws = [Box(lower, upper)], [LAWS[p.law](p.E, p.nu)]
    if p.scene == "layers":
        boxes.append(Box((lower[0], -2 * p.height, *lower[2:]), (upper[0], -p.height, *upper[2:])))
        laws.append(LAWS[p.law](p.E / p.contrast, p.nu))
    grid, counts = background(p, boxes)
    held = boxes[-1].lower[1] + 1e-6 * p.height
    supports = {"beam": [Support.column("x", end, grid, "y") for end in (lower[0], upper[0])], "free": [], "flight": [],
                "block": [Support(lambda x: x[:, 1] < held, "xyz"[:p.dim], name="support of the bottom")]}
    supports |= {"swing": supports["beam"], "layers": supports["block"], "rest": supports["block"]}
    return grid, [body(p, *part, counts) for part in zip(boxes, laws)], supports[p.scene], interface_on(p, counts)


def background(p, boxes):
    """Grid with cells of about ``h`` that fit the boxes, two more on each side, more where the body flies, and cells of
    a box."""
    counts = np.maximum(np.rint(boxes[0].size / p.h), 1).astype(int)
    h = boxes[0].size / counts
    around = np.full((2, p.dim), 2)
    if p.scene in ("free", "flight"):
        travel = p.windows * p.dt * np.array([abs(p.fly) + p.v0, 2 * p.v0, 0.0][:p.dim])
        n = np.prod(counts + 2 * travel / h)
        check.check_memory(f"{n:.3g} cells of the grid for a flight of {travel.max():.3g} m (windows={p.windows}, "
                           f"v0={p.v0:g}, fly={p.fly:g})", 600 * n, "take fewer windows or a smaller speed")
        around += np.ceil(travel / h + 1).astype(int)
    around[0, 1] += (len(boxes) - 1) * counts[1]
    return Grid(Box(tuple(boxes[0].lower - around[0] * h), tuple(boxes[0].upper + around[1] * h)),
                counts + around.sum(axis=0), p.cell), counts


def body(p, box, law, counts):
    """One block with its points seeded as ``seeding`` says."""
    state = f"plane_{p.plane}" if p.dim == 2 else None
    whole = Body(box, tuple(p.refine * counts), p.points, law, p.rho, state, p.width if p.dim == 2 else 1.0, p.cell,
                 references.start(p), p.f_bar)
    if p.seeding == "gauss":
        return whole
    x, volume = seed(whole)
    volume = volume / whole.thickness
    if p.seeding == "random":
        x = np.random.default_rng(1).uniform(box.lower, box.upper, x.shape)
        volume[:] = volume.mean()
    else:
        corner = np.array(box.upper)
        corner[0] += 1e-3 * p.h
        corner[1:] -= 1e-3 * p.h
        x, volume = np.vstack([x, corner]), np.append(volume, volume[-1])
    return Body(Cloud(x, volume), None, None, law, p.rho, state, whole.thickness, p.cell, whole.velocity, p.f_bar)


def interface_on(p, counts):
    """Boundary particles, two per cell."""
    box = Box((-p.length / 2, -p.height, -p.width / 2)[:p.dim], (p.length / 2, 0.0, p.width / 2)[:p.dim])
    across = [2 * counts[d] for d in range(p.dim) if d != 1]
    if p.scene != "free" or p.dim == 3:
        top = Interface.top(box, across)
        return Interface(top.x - [0.0, p.shift, 0.0][:p.dim], top.elements)
    (x0, y0), (x1, y1) = box.lower, box.upper
    up, along = 2 * counts[1], across[0]
    left, top, right = (Interface.line(a, b, n).x for a, b, n in (
        ((x0, y0), (x0, y1), up), ((x0, y1), (x1, y1), along), ((x1, y1), (x1, y0), up)))
    x = np.concatenate([left, top[1:-1], right])
    i = np.arange(len(x) - 1)
    return Interface(x, np.column_stack([i, i + 1]))


def grains(p, interface):
    """Spheres above the body, and the interface as their wall."""
    wall, steel = Wall(interface.x, interface.elements), Material(p.E, p.nu)
    if p.scene in ALONE:
        return Scene(Spheres.none(p.dim), wall, steel, steel)
    beyond = np.maximum(np.abs(p.at) - p.length / 2, 0.0)  # of an edge, around which the sphere then lies
    x = np.zeros((len(p.at), p.dim))
    x[:, 0], x[:, 1] = p.at, np.sqrt((p.radius + p.gap) ** 2 - beyond**2) - p.shift
    v = np.zeros_like(x)
    v[:, :2] = p.v0 * np.sin(np.radians(p.angle)), -p.v0 * np.cos(np.radians(p.angle))
    if p.scene == "rest":
        v[:] = 0.0
    return Scene(Spheres(x, v, p.radius, p.rho_ball), wall, Material(p.E_ball, p.nu), steel,
                 at_wall=Interaction(p.restitution, p.friction), gravity=(0.0, -p.gravity, 0.0)[:p.dim])


if __name__ == "__main__":
    cli.run(main)
