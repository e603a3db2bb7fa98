"""A steel sphere strikes a simply supported beam: the first example of Singer et al. 2022, in the plane.

    python cases/beam_impact.py                                   seconds, with the built-in DEM
    python cases/beam_impact.py dem=liggghts preset=paper         the paper's discretisation and time step
    python cases/beam_impact.py h=1e-3 law=neo_hooke -mpm_snes_monitor
"""
from typing import Literal, Optional, Tuple

import numpy as np

from coupling import Record, analytic, cli, count_windows, couple, figure, linear, nearest, report
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall, open_dem
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface, Support

PRESETS = {"paper": dict(cells=(62, 13), body=(120, 8), points=4, segments=60, dt=5e-8, substeps=1, t_end=4e-4)}


def main(
    length: float = 0.1535,  # of the beam [m]
    radius: float = 0.01,  # of the sphere [m]
    v0: float = 0.01,  # impact speed [m/s]
    E: float = 215.82e9,  # Young's modulus of beam and sphere [Pa]
    nu: float = 0.289,  # Poisson's ratio of both [-]
    rho: float = 7960.0,  # density of both [kg/m^3]
    h: float = 2e-3,  # size of the background cells, of which columns stand at the beam's ends [m]
    cells: Optional[Tuple[int, int]] = None,  # of the background grid, three beam heights high [-]; replaces h
    cell: Literal["quadrilateral", "triangle"] = "quadrilateral",  # kind of background cell and body cell
    body: Tuple[int, int] = (120, 8),  # body cells along and across the beam [-]
    points: int = 2,  # material points per body cell: per direction (quadrilateral) or in all (triangle) [-]
    segments: int = 60,  # of the interface on the beam's upper edge [-]
    wall_segments: Optional[int] = None,  # of the DEM wall [-]; none: as many, on the same places
    mapping: Literal["linear", "nearest"] = "linear",  # from interface to wall; both are a copy where places coincide
    dt: float = 2e-6,  # coupling window and MPM time step [s]
    substeps: int = 20,  # DEM steps per window [-]
    t_end: float = 4e-4,  # end of the run [s]
    plane: Literal["stress", "strain"] = "stress",  # plane state of the beam, which is 1 cm thick
    law: Literal["linear", "neo_hooke"] = "linear",  # of the beam
    restitution: float = 1.0,  # coefficient of the contact, 0.05 to 1 [-]; the reference has 1
    friction: float = 0.0,  # coefficient of the contact [-]
    dem: Literal["reference", "liggghts", "compare"] = "reference",  # back end; compare runs both
    shift: float = 0.0,  # of interface and wall into the beam, the paper's delta [m]
    gap: float = 0.0,  # between sphere and beam at the start [m]
    out: str = "out/beam_impact",  # folder of the results
    paraview: int = 0,  # windows from one ParaView file to the next [-]; 0: none
) -> dict:
    """Sphere on a beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz contact."""
    parameters, height, thickness = dict(locals()), 0.01, 0.01
    windows = count_windows(t_end, dt, substeps)
    reference = analytic.impact(length, height, thickness, radius, v0, E, nu, rho, t_end)
    box = Box((-length / 2, -height), (length / 2, 0.0))
    grid = background(box, cells, h, cell)
    beam = Body(box, body, points, LAWS[law](E, nu), rho, f"plane_{plane}", thickness, cell)
    supports = [Support.column("x", x, grid, "y", name=f"support of the {side} end")
                for x, side in zip((box.lower[0], box.upper[0]), ("left", "right"))]
    interface = Interface.top(box, segments, shift)
    wall = interface if wall_segments is None else Interface.top(box, wall_segments, shift)
    steel, ball = Material(E, nu), Spheres([(0.0, radius + gap - shift)], [(0.0, -v0)], radius, rho)
    scene = Scene(ball, Wall(wall.x, wall.elements), steel, steel, at_wall=Interaction(restitution, friction))
    follow = (nearest(interface.x, wall.x) if mapping == "nearest" else
              linear(interface.x, interface.elements, wall.x))
    columns = {"force": ("N", "force on the sphere, mean over the window", lambda w: 0 - w.wall_force[:, 1].sum()),
               "u_beam": ("m", "upward displacement of the beam's upper edge at midspan",
                          lambda w: np.interp(0.0, interface.x[:, 0], w.x[:, 1] - interface.x[:, 1])),
               "u_sphere": ("m", "upward displacement of the sphere", lambda w: w.particles["x"][0, 1] - ball.x[0, 1]),
               "v_sphere": ("m/s", "upward velocity of the sphere", lambda w: w.particles["v"][0, 1])}
    runs = {}
    for backend in ("liggghts", "reference") if dem == "compare" else (dem,):
        solid, grains = MPM(grid, beam, supports, interface), open_dem(backend, scene, dt / substeps)
        with Record("beam_impact", parameters, out, solid, grains, windows=windows, columns=columns, paraview=paraview,
                    label="liggghts" if (dem, backend) == ("compare", "liggghts") else "") as record:
            couple(solid, grains, follow, dt=dt, t_end=t_end, substeps=substeps, on_window=[record])
            runs[backend] = record.history
            record.finish(compare(runs, reference, dt, gap / v0), lambda path: draw(path, runs, reference, gap / v0))
        solid.close(), grains.close()
    return runs


def background(box, cells, h, cell):
    """Grid of three beam heights with cells of size h [m], one column beside the beam; or with ``cells``, 2.6 mm beside
    it as in the paper."""
    (length, height), margin = box.size, 0.0026
    if cells is None:
        if not 0 < h <= height:
            raise ValueError(f"h is {h} m: the cell size must lie between 0 and the beam's height of {height} m")
        columns = round(length / h)
        margin, cells = length / columns, (columns + 2, round(3 * height / h))
    return Grid(Box((box.lower[0] - margin, -2 * height), (box.upper[0] + margin, height)), cells, cell)


def compare(runs, reference, dt, wait):
    """Errors of the last of ``runs`` against the reference, whose contact starts after ``wait`` [s], and the largest
    difference in force between back ends. The force is the mean over a window: it belongs to the window's middle."""
    *others, history = runs.values()
    at_end, at_middle = (reference.at(np.maximum(history["time"] - wait - lag, 0.0)) for lag in (0.0, dt / 2))
    errors = {"force": report.relative_l2(history["force"], at_middle.force),
              "u_beam": report.relative_l2(history["u_beam"], at_end.u_beam),
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


if __name__ == "__main__":
    cli.run(main, PRESETS)
