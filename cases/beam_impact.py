"""A steel sphere strikes a simply supported beam: the first example of Singer et al. 2022, in the plane and in space.

    python cases/beam_impact.py                                   seconds, with the built-in DEM
    python cases/beam_impact.py dim=3                             the beam in space
    python cases/beam_impact.py dem=liggghts preset=paper         the paper's discretisation and time step; or paper_3d
    python cases/beam_impact.py h=1e-3 law=neo_hooke -mpm_snes_monitor
"""
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, Optional, Tuple

import numpy as np
from mpi4py import MPI

import mpm_dem_checks as check
from coupling import Record, Scheme, analytic, cli, count_windows, couple, linear, nearest, spread
from coupling.keys import of_iteration, refuse_unused
from coupling.maps.spread import compliance_in_plane, compliance_in_space
from coupling.pictures import figure, picture
from coupling.records import report
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall, open_dem
from mpm_fenicsx import LAWS, MPM, SOLVERS, Body, Box, Grid, Interface, Numerics, Support

PAPER = dict(dt=5e-8, substeps=1, t_end=4e-4)
PRESETS = {"paper": dict(cells=(62, 13), body=(120, 8), points=4, segments=(60,), **PAPER),
           "paper_3d": dict(dim=3, cells=(62, 13, 7), body=(120, 8, 10), points=2, segments=(77, 10), **PAPER)}
BODY, SEGMENTS = {2: (120, 8), 3: (80, 5, 5)}, {2: (60,), 3: (77, 10)}  # unless others are asked for
HEIGHT = WIDTH = 0.01  # of the beam [m]
PLAIN = dict(wall_segments=None, mapping="linear", plane="stress", law="linear", restitution=1.0, friction=0.0,
             rho_sphere=None, shift=0.0, gap=0.0, rebalance=1.2, f_bar=False, spread=0.0,
             take_out=False)
SCHEME = "dt", "t_end", "substeps", "iterate", "tol", "relax", "adapt"  # keys that go on to couple()


def main(
    dim: Literal[2, 3] = 2,  # in the plane or in space
    length: float = 0.1535,  # of the beam [m]
    radius: float = 0.01,  # of the sphere [m]
    v0: float = 0.01,  # impact speed [m/s]
    E: float = 215.82e9,  # Young's modulus of beam and sphere [Pa]
    nu: float = 0.289,  # Poisson's ratio of both [-]
    rho: float = 7960.0,  # density of both [kg/m^3]
    rho_sphere: Optional[float] = None,  # density of the sphere, where it is another one [kg/m^3]
    h: float = 2e-3,  # size of the background cells, of which columns stand at the beam's ends [m]
    cells: Optional[Tuple[int, ...]] = None,  # of the grid along, up (3 beam heights) and across [-]; replaces h
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None,  # of grid and body
    body: Optional[Tuple[int, ...]] = None,  # body cells along, up and across [-]; none: 120,8 or 80,5,5
    points: int = 2,  # material points per body cell: in all (triangle, tetrahedron) or per direction (others) [-]
    segments: Optional[Tuple[int, ...]] = None,  # of the interface on top, along and across [-]; none: 60 or 77,10
    wall_segments: Optional[Tuple[int, ...]] = None,  # of the DEM wall [-]; none: as many, on the same places
    mapping: Literal["linear", "nearest"] = "linear",  # from interface to wall; both are a copy where places coincide
    spread: float = 0.0,  # radius over which the contact force is spread [m], see docs/error_floor.md; 0: as it comes
    take_out: bool = False,  # the dent that is left under it, which Hertz's law contains
    dt: float = 2e-6,  # coupling window and MPM time step [s]
    substeps: int = 20,  # DEM steps per window [-]
    iterate: int = 0,  # most repetitions of a window until both sides agree [-]; 0: weak coupling
    tol: float = 1e-4,  # how well they agree, as a part of the force [-]
    relax: Literal["aitken", "constant", "iqn"] = "aitken",  # how the force is corrected in a repetition
    adapt: Optional[float] = 0.0,  # shorter windows; none: never, 0: where one fails, 0.01: also for that error [-]
    t_end: float = 4e-4,  # end of the run [s]
    plane: Literal["stress", "strain"] = "stress",  # plane state of the beam, which is 1 cm thick (dim=2)
    law: Literal["linear", "neo_hooke"] = "linear",  # of the beam
    f_bar: bool = False,  # average the volume change over patches, against locking of triangles and tetrahedra
    restitution: float = 1.0,  # coefficient of the contact, 0 to 1 [-]; the reference has 1
    friction: float = 0.0,  # coefficient of the contact [-]
    solver: Literal[SOLVERS] = "auto",  # of the linear systems, see docs/solvers.md; -mpm_… options win over it
    dem: Literal["reference", "liggghts", "compare"] = "reference",  # back end; compare runs both
    shift: float = 0.0,  # of interface and wall into the beam, the paper's delta [m]
    gap: float = 0.0,  # between sphere and beam at the start [m]
    rebalance: float = 1.2,  # imbalance of material points over the ranks that calls for a new partition [-]
    out: Path = Path("out/beam_impact"),  # folder of the results
    paraview: int = 0,  # windows from one ParaView file to the next [-]; 0: none
    picture: float = 0.0,  # magnification of the displacements in a picture of the end [-]; 0: no picture
) -> dict:
    """Sphere on a beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz contact."""
    keys = dict(locals())
    check.not_negative("spread", spread, "m")
    refuse_unused(main, keys, {"mapping": (wall_segments is not None, "where the wall has nodes of its own, "
                                           "wall_segments=37"), "take_out": (spread > 0, "with spread="),
                               **uses(keys)})
    return strike("beam_impact", compare, **keys)


def uses(keys):
    """For ``refuse_unused``: what keys of this and the next example depend on."""
    return {"h": (keys["cells"] is None, "without cells="), **of_iteration(keys["iterate"]),
            "plane": (keys["dim"] == 2, "in the plane, dim=2")}


def strike(case, compare, modes=50, **keys):
    """Run the sphere against the beam with the ``keys`` of ``main``; ``compare`` gives the errors against the reference
    with that many ``modes``. Returns the history per back end."""
    p = SimpleNamespace(**{**PLAIN, **keys})
    windows = count_windows(p.t_end, p.dt, p.substeps)
    check.not_negative("picture", p.picture)
    check.not_negative("gap", p.gap, "m")
    if p.wall_segments is not None:
        check.counts("wall_segments", p.wall_segments, p.dim - 1)
    rho_sphere = p.rho if p.rho_sphere is None else check.positive("rho_sphere", p.rho_sphere, "kg/m^3")
    reference = analytic.impact(p.length, HEIGHT, WIDTH, p.radius, p.v0, p.E, p.nu, p.rho, p.t_end, modes=modes,
                                sphere=(p.E, p.nu, rho_sphere))
    grid, beam, supports, interface = solid_scene(p)
    wall = interface if p.wall_segments is None else Interface.top(beam.box, p.wall_segments, p.shift)
    steel = Material(p.E, p.nu)
    start = np.array([[0.0, p.radius + p.gap - p.shift, 0.0]])[:, :p.dim]
    ball = Spheres(start, np.array([[0.0, -p.v0, 0.0]])[:, :p.dim], p.radius, rho_sphere)
    scene = Scene(ball, Wall(wall.x, wall.elements), steel, steel, at_wall=Interaction(p.restitution, p.friction))
    follow = (nearest(interface.x, wall.x) if p.mapping == "nearest" else
              linear(interface.x, interface.elements, wall.x))
    follow = spread(follow, p.spread, dent(p) if p.take_out else 0.0)
    midspan = linear(interface.x, interface.elements, np.zeros((1, p.dim)), MPI.COMM_SELF)
    columns = {"force": ("N", "force on the sphere, mean over the window", lambda w: 0 - w.wall_force[:, 1].sum()),
               "u_beam": ("m", "upward displacement of the beam's upper side at midspan",
                          lambda w: midspan.motion(w.x, w.v)[0][0, 1]),
               "u_sphere": ("m", "upward displacement of the sphere", lambda w: w.particles["x"][0, 1] - ball.x[0, 1]),
               "v_sphere": ("m/s", "upward velocity of the sphere", lambda w: w.particles["v"][0, 1])}
    runs, wait = {}, p.gap / p.v0
    for backend in ("liggghts", "reference") if p.dem == "compare" else (p.dem,):
        label = "liggghts" if (p.dem, backend) == ("compare", "liggghts") else ""
        solid = MPM(grid, beam, supports, interface, numerics=Numerics(p.solver, p.rebalance))
        grains = open_dem(backend, scene, p.dt / p.substeps)
        start_points = solid.snapshot() if p.picture else None
        with Record(case, keys, p.out, solid, grains, windows=windows, columns=columns, paraview=p.paraview,
                    label=label) as record:
            couple(solid, grains, follow, Scheme(**{key: keys[key] for key in SCHEME}), on_window=[record])
            runs[backend] = record.history
            record.finish(compare(runs, reference, wait), lambda path: draw(path, runs, reference, wait))
            if p.picture:
                show(record.path(f"{case}_scene.png"), p, start_points, solid.snapshot(), scene, grains.particles())
        solid.close(), grains.close()
    return runs


def dent(p):
    """Compliance [m/N] that the beam still has under a force spread over ``spread``, and Hertz's law contains."""
    if p.dim == 3:
        return compliance_in_space(p.spread, p.E, p.nu)
    return compliance_in_plane(p.spread, p.E if p.plane == "stress" else p.E / (1 - p.nu**2), WIDTH)


def solid_scene(p):
    """Grid, beam, its supports and the interface on top for the keys ``p``. The origin is at midspan on top."""
    box = Box((-p.length / 2, -HEIGHT, -WIDTH / 2)[:p.dim], (p.length / 2, 0.0, WIDTH / 2)[:p.dim])
    grid = background(box, p.cells, p.h, p.cell)
    state, thickness = (f"plane_{p.plane}", WIDTH) if p.dim == 2 else (None, 1.0)
    beam = Body(box, p.body or BODY[p.dim], p.points, LAWS[p.law](p.E, p.nu), p.rho, state, thickness, p.cell,
                f_bar=p.f_bar)
    supports = [Support.column("x", x, grid, "y", name=f"support of the {side} end")
                for x, side in zip((box.lower[0], box.upper[0]), ("left", "right"))]
    segments = SEGMENTS[p.dim] if p.segments is None else p.segments
    return grid, beam, supports, Interface.top(box, segments, p.shift)


def background(box, cells, h, cell):
    """Grid of three beam heights with cells of size h [m], one column beside the beam on each side; or with ``cells``,
    2.6 mm beside it as in the paper."""
    size, beside = box.size, [d for d in range(box.dim) if d != 1]
    margin = np.full(box.dim, 0.0026)
    if cells is None:
        check.between("h", h, 0, HEIGHT, "m",
                      f"the cell size must lie between 0 and the beam's height of {HEIGHT} m", "(]")
        check.positive("h", h, "m")
        columns = np.rint(size / h)  # floats: of tiny cells there are more than an integer counts
        margin, cells = size / columns, columns + 2
        cells[1] = round(3 * HEIGHT / h)
    lower, upper = np.array(box.lower), np.array(box.upper)
    lower[beside], upper[beside] = lower[beside] - margin[beside], upper[beside] + margin[beside]
    lower[1], upper[1] = -2 * HEIGHT, HEIGHT
    return Grid(Box(tuple(lower), tuple(upper)), cells, cell)


def compare(runs, reference, wait):
    """Errors of the last of ``runs`` against the reference, whose contact starts after ``wait`` [s], and the largest
    difference in force between back ends. The force is the mean over a window: it belongs to the window's middle."""
    *others, history = runs.values()
    at_end, at_middle = (reference.at(np.maximum(history["time"] - wait - lag, 0.0))
                         for lag in (0.0, history["window"] / 2))
    errors = {"force": report.relative_l2(history["force"], at_middle.force, history["window"]),
              "u_beam": report.relative_l2(history["u_beam"], at_end.u_beam, history["window"]),
              "v_sphere_end": abs(history["v_sphere"][-1] / at_end.v_sphere[-1] - 1)}
    for other in others:
        errors["back_ends"] = abs(other["force"] - history["force"]).max() / abs(history["force"]).max()
    return {name: float(error) for name, error in errors.items()}


def draw(path, runs, reference, wait):
    """The paper's figure 7: displacements and contact force over time."""
    displacement, force, (*_, last) = [], [], runs
    for backend, history in runs.items():
        t, style = 1e3 * history["time"], "run" if backend == last else "under"
        name = "LIGGGHTS" if backend == "liggghts" else "built-in DEM"
        displacement += [(t, 1e6 * history["u_beam"], f"beam at midspan, {name}", style),
                         (t, 1e6 * history["u_sphere"], f"sphere, {name}", style)]
        force.append((t, history["force"], f"contact, {name}", style))
    t, gap = 1e3 * (reference.time + wait), wait * abs(reference.v_sphere[0])
    displacement += [(t, 1e6 * reference.u_beam, "Timoshenko beam", "reference"),
                     (t, 1e6 * (reference.u_sphere - gap), None, "reference")]
    force.append((t, reference.force, "Timoshenko beam", "reference"))
    figure.draw(path, "time [ms]", {"upward displacement [µm]": displacement, "contact force [N]": force})


def show(path, p, before, after, scene, particles):
    """Picture of the end, displacements magnified, with the stress along the beam; before, after: snapshots."""
    if not after:
        return  # not on rank 0
    x, (_, _, data) = before["points"][0], after["points"]
    nodes, ((_, elements),), surface = after["interface"][0], after["interface"][1].items(), after["interface"][2]
    grid, ((_, around),) = after["grid"][0], after["grid"][1].items()
    start = scene.spheres.x
    picture.draw(path, x + p.picture * (after["points"][0] - x), (grid, around),
                 (nodes + (p.picture - 1) * surface["displacement"], elements),
                 (start + p.picture * (particles["x"][:, :p.dim] - start), scene.spheres.radius),
                 1e-6 * data["cauchy_stress"][:, 0, 0], "stress along the beam [MPa]")


if __name__ == "__main__":
    cli.run(main, PRESETS)
