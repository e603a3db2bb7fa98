"""A column of dry soil collapses against three wooden blocks: the third example of Singer et al. 2022.

    python cases/granular_blocks.py                               a minute, with cells of 1 cm
    python cases/granular_blocks.py contact=points                material points as small discs instead of an outline
    python cases/granular_blocks.py dem=liggghts preset=paper     the paper's grid and time step
"""
import inspect
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, Optional, Tuple

import column_collapse
from beam_impact import SCHEME
from blocks_history import Obstacles, draw, events, miss

import mpm_dem_checks as check
from coupling import Record, Scheme, cli, count_windows, couple, nearest
from coupling.keys import of_iteration, refuse_unused
from dem_liggghts import (
    Cluster,
    Interaction,
    Material,
    Scene,
    Spheres,
    Wall,
    check_size,
    critical_step,
    open_dem,
)
from mpm_fenicsx import SOLVERS, Interface, of_points

PRESETS = {"paper": dict(h=0.005, dt=5e-5, substeps=5)}
WOOD, WOOD_RHO = Material(50e6, 0.5), 500.0  # table 1 of the paper [kg/m^3]


def main(
    h: float = 0.01,  # size of the background cells [m]
    dt: float = 5e-4,  # coupling window and MPM time step [s]
    substeps: int = 50,  # DEM steps per window [-]
    iterate: int = 0,  # most repetitions of a window until both sides agree [-]; 0: weak coupling
    tol: float = 1e-4,  # how well they agree, as a part of the force [-]
    relax: Literal["aitken", "constant", "iqn"] = "aitken",  # how the force is corrected in a repetition
    adapt: Optional[float] = 0.0,  # shorter windows; none: never, 0: where one fails, 0.01: also for that error [-]
    t_end: float = 0.5,  # end of the run [s]
    law: Literal["mohr_coulomb", "drucker_prager"] = "mohr_coulomb",  # of the soil
    E: float = 50e3,  # Young's modulus of the soil [Pa]
    phi: float = 22.0,  # friction angle of the soil [degrees]
    contact: Literal["outline", "points"] = "outline",  # particles around the soil, or its points as discs
    wall_E: float = 0.5e6,  # modulus of the soil in contact with its outline [Pa]
    inset: float = 0.05,  # of the outline into the soil, the paper's delta [body cells]
    spacing: Optional[float] = None,  # of the outline's boundary particles [m]; none: half a body cell
    disc_E: float = 10e6,  # modulus of the discs [Pa]
    disc: float = 0.5,  # radius of the discs [mean spacings of the material points]
    friction: float = 0.3,  # of soil on blocks [-]
    soil_restitution: float = 1.0,  # of soil on blocks; below 1 the windows must be short, see docs/blocks.md [-]
    restitution: float = 0.05,  # of blocks with each other and the floor [-]
    adhesion: float = 30.0,  # of blocks with each other; with the floor it is twice that [Pa]
    blocks: int = 3,  # in the stack, of which the lowest is fixed [-]
    block: Tuple[float, float] = (0.02, 0.018),  # width and height of one [m]
    spheres: int = 8,  # in a block along each side [-]
    at: float = 0.30,  # left faces of the blocks [m]
    depth: float = 0.198,  # of soil and blocks [m]
    box: Tuple[float, float] = (0.8, 0.5),  # size of the grid [m]
    outflow: Literal["stop", "hold", "remove"] = "remove",  # of soil at open sides of the grid; stop: that ends the run
    solver: Literal[SOLVERS] = "auto",  # of the linear systems, see docs/solvers.md; -mpm_… options win over it
    dem: Literal["reference", "liggghts", "compare"] = "reference",  # back end; compare runs both
    out: Path = Path("out/granular_blocks"),  # folder of the results
    paraview: int = 0,  # windows from one ParaView file to the next [-]; 0: none
    animation: int = 0,  # windows from one picture to the next of an animated GIF [-]; 0: none
) -> dict:
    """Granular flow against three blocks: their places and rotation over time, pictures at the paper's times."""
    keys, runs = dict(locals()), {}
    discs, line = (contact == "points", "with contact=points"), (contact == "outline", "with contact=outline")
    refuse_unused(main, keys, {"disc": discs, "disc_E": discs, "wall_E": line, "inset": line, "spacing": line,
                               **of_iteration(iterate)})
    soil = {name: key.default for name, key in inspect.signature(column_collapse.main).parameters.items()}
    p = SimpleNamespace(**{**soil, **keys, "height": soil["aspect"] * soil["width"], "thickness": depth})
    windows = count_windows(t_end, dt, substeps)
    check_blocks(p)
    for backend in ("liggghts", "reference") if dem == "compare" else (dem,):
        label = "liggghts" if (dem, backend) == ("compare", "liggghts") else ""
        solid = column_collapse.make_column(p, of_points if contact == "points" else lambda body: outline(p, body))
        scene = make_scene(p, solid.interface)
        grains = open_dem(backend, scene, dt / substeps)
        flow = Obstacles(solid, grains, p)
        with Record("granular_blocks", keys, out, solid, grains, windows=windows, columns=flow.columns(),
                    gravity=-p.g, paraview=paraview, label=label,
                    pictures=flow.pictures(f"granular_blocks_flow{'_' if label else ''}{label}")) as record:
            x = solid.interface.x
            couple(solid, grains, nearest(x, x), Scheme(**{key: keys[key] for key in SCHEME}), on_window=[flow, record])
            runs[backend] = record.history
            table = events(record.history, p)
            record.finish(miss(table, runs), lambda path: draw(path, runs, p), events=table)
        solid.close(), grains.close()
    return runs


def outline(p, body):
    """Boundary particles around the soil, but for the wall and the floor."""
    return Interface.around(body, p.spacing, p.inset, ("x-", "y-"), "y-")


def check_blocks(p):
    """ValueError for keys of the blocks that make no stack in the grid."""
    check.count("blocks", p.blocks)
    check.count("spheres", p.spheres, 2)
    check.count("animation", p.animation, 0)
    for name, unit in (("depth", "m"), ("wall_E", "Pa"), ("disc_E", "Pa"), ("disc", "")):
        check.positive(name, getattr(p, name), unit)
    check.not_negative("adhesion", p.adhesion, "Pa")
    check.between("soil_restitution", p.soil_restitution, 0, 1)
    check.numbers("block", p.block, 2, "m", check.positive)
    check.numbers("box", p.box, 2, "m", check.positive)
    check.not_negative("at", p.at, "m")
    mass = WOOD_RHO * p.depth * math.prod(p.block)
    for name, value, unit in (("mass", mass, "kg"), ("inertia", mass * math.hypot(*p.block)**2 / 12, "kg m^2")):
        check.positive(f"{name} of a block (block, depth)", value, unit)
    radius = 0.5 * max(p.block) / p.spheres
    limit = min(critical_step(Scene(Spheres([[0.0, 0.0]], [[0.0, 0.0]], radius, WOOD_RHO), material=WOOD)))
    if p.dt / p.substeps > 100.0 * limit:  # the scene itself is looked at more closely, but takes time to build
        raise ValueError(f"spheres is {p.spheres}: spheres of {radius:.3g} m need DEM steps of about {limit:.3g} s, take "
                         "fewer of them or more substeps")
    check_size(p.blocks * p.spheres**2, f"blocks={p.blocks} spheres={p.spheres}", p.substeps)


def make_scene(p, interface):
    """Blocks, floor and the surface of the soil for the DEM."""
    stack = [Cluster.box(p.block, (p.spheres, p.spheres), (p.at + p.block[0] / 2, (k + 0.5) * p.block[1]), WOOD_RHO,
                         p.depth, free=k > 0, material="wood") for k in range(p.blocks)]
    soil, modulus = surface_of(p, interface)
    floor = Wall([[0.0, 0.0], [p.box[0], 0.0]], [[0, 1]], material="floor")
    meet = {("wood", "wood"): Interaction(p.restitution, 0.6, p.adhesion),
            ("wood", "floor"): Interaction(p.restitution, 0.3, 2 * p.adhesion),
            ("wood", "soil"): Interaction(p.soil_restitution, p.friction)}
    return Scene(wall=soil, clusters=stack, walls=[floor], gravity=(0.0, -p.g), interactions=meet,
                 materials={"wood": WOOD, "floor": WOOD, "soil": Material(modulus, p.nu)})


def surface_of(p, interface):
    """The wall of the soil and its modulus [Pa]; an outline pushes outwards only, as deep as a sphere is wide."""
    if p.contact == "points":
        mean = math.sqrt(p.width * p.height / len(interface.x))
        return Wall.discs(interface.x, p.disc * mean, "soil"), p.disc_E
    return Wall(interface.x, interface.elements, max(p.block) / p.spheres, "soil"), p.wall_E


if __name__ == "__main__":
    cli.run(main, PRESETS)
