"""A column of dry soil collapses against three wooden blocks: the third example of Singer et al. 2022.

    python cases/granular_blocks.py                              a minute, with cells of 1 cm
    python cases/granular_blocks.py contact=points               material points as small discs, no outline
    python cases/granular_blocks.py dem=liggghts preset=paper    the paper's grid and time step
"""
import math
from functools import partial
from pathlib import Path
from typing import Any, Literal, Optional, Tuple

import mpm_dem_checks as check
from coupling import FlowPictures, Output, Run, Scheme, case
from dem_liggghts import Interaction, Material, Wall
from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    FlowGauges,
    Grid,
    Interface,
    Numerics,
    Soil,
    Support,
    flow_grid,
    level_floor,
    of_points,
)
from references import blocks, granular
from references.stack import Stack

DISCS = (lambda keys: keys["contact"] == "points", "with contact=points")
LINE = (lambda keys: keys["contact"] == "outline", "with contact=outline")


@case(presets={"paper": dict(h=0.005, dt=5e-5, substeps=5)},
      counts={"disc": DISCS, "disc_E": DISCS, "wall_E": LINE, "inset": LINE, "spacing": LINE})
def main(
    h: float = 0.01,  # size of the background cells [m]
    soil: Soil = granular.SOIL,
    contact: Literal["outline", "points"] = "outline",  # particles around the soil, or its points as discs
    wall_E: float = 0.5e6,  # modulus of the soil in contact with its outline [Pa]
    inset: float = 0.05,  # of the outline into the soil, the paper's delta [body cells]
    spacing: Optional[float] = None,  # of the outline's boundary particles [m]; none: half a body cell
    disc_E: float = 10e6,  # modulus of the discs [Pa]
    disc: float = 0.5,  # radius of the discs [mean spacings of the material points]
    friction: float = 0.3,  # of soil on blocks [-]
    soil_restitution: float = 1.0,  # of soil on blocks; below 1 take short windows, see docs/blocks.md [-]
    stack: Stack = Stack(),
    depth: float = 0.198,  # of soil and blocks [m]
    box: Tuple[float, float] = (0.8, 0.5),  # size of the grid [m]
    outflow: Literal["stop", "hold", "remove"] = "remove",  # of soil at open sides; stop: that ends the run
    numerics: Numerics = Numerics(),
    scheme: Scheme = Scheme(dt=5e-4, t_end=0.5, substeps=50),
    output: Output = Output(Path("out/granular_blocks")),
) -> Run:
    """Granular flow against three blocks: their places and rotation over time, pictures at given times."""
    check.positive("depth", depth, "m")
    check.positive("wall_E", wall_E, "Pa")
    check.positive("disc_E", disc_E, "Pa")
    check.positive("disc", disc)
    check.between("soil_restitution", soil_restitution, 0, 1)
    stack.check_steps(depth, scheme.inner, scheme.substeps)
    size = granular.SIZE
    body = Body(Box((0.0, 0.0), size), tuple(2 * n for n in Grid.counts(size, h)), 3, soil.material(2),
                soil.rho, cell="triangle", thickness=depth, f_bar=True)
    grid = flow_grid(size, h, box)
    supports = [*level_floor("stick", h, dim=2)[0], Support.column("x", 0.0, grid, "x", name="the wall")]
    if contact == "points":
        surface, modulus = of_points(body, numerics.basis), disc_E
        wall = Wall.discs(surface.x, disc * math.sqrt(math.prod(size) / len(surface.x)), "soil")
    else:  # pushes outwards only, as deep as a sphere is wide
        surface, modulus = Interface.around(body, spacing, inset, ("x-", "y-"), "y-"), wall_E
        wall = Wall(surface.x, surface.elements, stack.sphere, "soil")
    solid = MPM(grid, body, supports, surface, gravity=(0.0, -granular.GRAVITY), inertia="lumped",
                outflow={"+x": outflow, "+y": outflow}, numerics=numerics)
    touch = Interaction(soil_restitution, friction)
    grains = stack.scene(wall, Material(modulus, soil.nu), touch, depth, box[0], granular.GRAVITY)

    def observe(solid: Any, grains: Any) -> list:
        of_blocks = blocks.BlockGauges(solid, grains, stack.block, stack.known)
        flow = FlowPictures("granular_blocks", granular.TIMES, solid, of_blocks.shapes)
        return [FlowGauges(solid), of_blocks, flow]

    return Run("granular_blocks", solid, grains, scheme, output, observe=observe,
               errors=partial(blocks.errors, blocks=stack.blocks, known=stack.known),
               figure=partial(blocks.draw, blocks=stack.blocks))


if __name__ == "__main__":
    main.run()
