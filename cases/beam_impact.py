"""A steel sphere strikes a simply supported beam: the first example of Singer et al. 2022, in the plane.

    python cases/beam_impact.py                                   seconds, with the built-in DEM
    python cases/beam_impact.py dem=liggghts preset=paper         the paper's discretisation and time step
    python cases/beam_impact.py h=1e-3 law=neo_hooke -mpm_snes_monitor
"""
from typing import Literal, Optional, Tuple

from coupling import Record, analytic, cli, count_windows, couple, figure, nearest, report
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall, open_dem
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface, Support

PRESETS = {"paper": dict(cells=(62, 13), body=(120, 8), points=4, segments=60, dt=5e-8, substeps=1, t_end=4e-4)}


def main(
    length: float = 0.1535,  # of the beam [m]
    radius: float = 0.01,  # of the sphere [m]
    v0: float = 0.01,  # impact speed [m/s]
    E: float = 215.82e9,  # Young's modulus of beam and sphere [Pa]
    nu: float = 0.289,  # Poisson's ratio of both
    rho: float = 7960.0,  # density of both [kg/m^3]
    cells: Tuple[int, int] = (62, 13),  # of the background grid, which is three beam heights high
    h: Optional[float] = None,  # cell size [m]; replaces cells
    cell: Literal["quadrilateral", "triangle"] = "quadrilateral",  # kind of background cell and body cell
    body: Tuple[int, int] = (120, 8),  # body cells along and across the beam
    points: int = 4,  # material points per body cell: per direction (quadrilateral) or in all (triangle)
    segments: int = 60,  # of the interface on the beam's upper edge
    dt: float = 1e-6,  # coupling window and MPM time step [s]
    substeps: int = 20,  # DEM steps per window
    t_end: float = 4e-4,  # [s]
    plane: Literal["stress", "strain"] = "stress",  # the beam's thickness is 1 cm
    law: Literal["linear", "neo_hooke"] = "linear",  # of the beam
    restitution: float = 1.0,  # of the contact
    friction: float = 0.0,  # of the contact
    dem: Literal["reference", "liggghts", "compare"] = "reference",  # back end; compare runs both
    shift: float = 0.0,  # of the boundary particles into the beam (the paper's delta) [m]
    gap: float = 0.0,  # between sphere and beam at the start [m]
    out: str = "out/beam_impact",  # folder of the results
    paraview: int = 0,  # write ParaView files every so many windows; 0: none
) -> dict:
    """Sphere on a beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz contact."""
    parameters, height, thickness = dict(locals()), 0.01, 0.01
    windows = count_windows(t_end, dt, substeps)
    reference = analytic.impact(length, height, thickness, radius, v0, E, nu, rho, t_end)
    box = Box((-length / 2, -height), (length / 2, 0.0))
    margin = 0.0026 if h is None else h  # with h, grid columns stand at the ends of the beam
    grid = Grid(Box((box.lower[0] - margin, -2 * height), (box.upper[0] + margin, height)),
                cells if h is None else Grid.counts((length + 2 * h, 3 * height), h), cell)
    beam = Body(box, body, points, LAWS[law](E, nu), rho, f"plane_{plane}", thickness, cell)
    supports = [Support.column("x", x, grid, "y", name=f"support of the {side} end")
                for x, side in zip((box.lower[0], box.upper[0]), ("left", "right"))]
    interface = Interface.top(box, segments, shift)
    steel, ball = Material(E, nu), Spheres([(0.0, radius + gap - shift)], [(0.0, -v0)], radius, rho)
    scene = Scene(ball, Wall(interface.x, interface.elements), steel, steel,
                  at_wall=Interaction(restitution, friction))
    runs = {}
    for backend in ("reference", "liggghts") if dem == "compare" else (dem,):
        solid = MPM(grid, beam, supports, interface)
        grains = open_dem(backend, scene, dt / substeps)
        columns = {"force": ("N", lambda w: -w.wall_force[:, 1].sum()),
                   "u_beam": ("m", lambda w: interface.at_x(0.0, solid.surface()[0] - interface.x)[1]),
                   "u_sphere": ("m", lambda w: grains.particles()["x"][0, 1] - ball.x[0, 1]),
                   "v_sphere": ("m/s", lambda w: grains.particles()["v"][0, 1])}
        with Record("beam_impact", parameters, out, solid, grains, windows=windows, columns=columns, paraview=paraview,
                    label="" if not runs else backend) as record:
            couple(solid, grains, nearest(interface.x, scene.wall.nodes), dt=dt, t_end=t_end, substeps=substeps,
                   on_window=[record])
        runs[backend] = record
        errors = compare(record.history, reference, dt)
        if len(runs) == 2:
            forces = [run.history["force"] for run in runs.values()]
            errors["back_ends"] = float(abs(forces[1] - forces[0]).max() / abs(forces[0]).max())
        record.finish(errors, lambda path: draw(path, record.history, reference))
    return {name: run.history for name, run in runs.items()}


def compare(history, reference, dt):
    """Relative errors. The force is the mean over a window: it belongs to the window's middle."""
    at_end, at_middle = reference.at(history["time"]), reference.at(history["time"] - dt / 2)
    return {"force": report.relative_l2(history["force"], at_middle.force),
            "u_beam": report.relative_l2(history["u_beam"], at_end.u_beam),
            "v_sphere_end": float(abs(history["v_sphere"][-1] / at_end.v_sphere[-1] - 1))}


def draw(path, history, reference):
    """The paper's figure 7: displacements and contact force over time."""
    t, fine = 1e3 * history["time"], 1e3 * reference.time
    figure.draw(path, "time [ms]", {
        "displacement [µm]": [(t, 1e6 * history["u_beam"], "beam, midspan"), (t, 1e6 * history["u_sphere"], "sphere"),
                              (fine, 1e6 * reference.u_beam, None), (fine, 1e6 * reference.u_sphere, "Timoshenko beam")],
        "contact force [N]": [(t, history["force"], "force"), (fine, reference.force, None)]})


if __name__ == "__main__":
    cli.run(main, PRESETS)
