"""A steel sphere strikes a simply supported beam: the first example of Singer et al. 2022, in the plane and
in space.

    python cases/beam_impact.py                                   seconds, with the built-in DEM
    python cases/beam_impact.py dim=3                             the beam in space
    python cases/beam_impact.py dem=liggghts preset=paper         the paper's cells and time step; or paper_3d
    python cases/beam_impact.py h=1e-3 law=neo_hooke -mpm_snes_monitor
"""
from dataclasses import replace
from pathlib import Path
from typing import Literal, Optional, Tuple

import mpm_dem_checks as check
from coupling import Output, Run, Scheme, case, indentation_compliance, linear, nearest
from coupling import spread as spread_over
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import LAWS, MPM, Interface, Numerics, SimplySupportedBeam
from references.beam_theory import impact
from references.sphere_on_beam import Comparison

PAPER = dict(dt=5e-8, substeps=1, t_end=4e-4)
PRESETS = {"paper": dict(cells=(62, 13), body=(120, 8), points=4, segments=(60,), **PAPER),
           "paper_3d": dict(dim=3, cells=(62, 13, 7), body=(120, 8, 10), points=2, segments=(77, 10),
                            **PAPER)}
COUNTS = {"mapping": (lambda k: k["wall_segments"] is not None, "where the wall has nodes of its own, "
                      "wall_segments=37"), "take_out": (lambda k: k["spread"] > 0, "with spread="),
          "plane": (lambda k: k["dim"] == 2, "in the plane, dim=2")}
BODY, SEGMENTS = {2: (120, 8), 3: (80, 5, 5)}, {2: (60,), 3: (77, 10)}  # unless others are asked for


@case(presets=PRESETS, counts=COUNTS)
def main(
    beam: SimplySupportedBeam = SimplySupportedBeam(),
    plane: Literal["stress", "strain"] = "stress",  # plane state of the beam (dim=2)
    law: Literal["linear", "neo_hooke"] = "linear",  # of the beam
    f_bar: bool = False,  # volume change averaged over patches, against locking of triangles and tetrahedra
    shift: float = 0.0,  # of interface and wall into the beam, the paper's delta [m]
    radius: float = 0.01,  # of the sphere [m]; its modulus and Poisson's ratio are those of the beam
    rho_sphere: Optional[float] = None,  # density of the sphere, where it is another one [kg/m^3]
    v0: float = 0.01,  # impact speed [m/s]
    at: float = 0.0,  # place of the impact along the beam, from midspan [m]
    gap: float = 0.0,  # between sphere and beam at the start [m]
    restitution: float = 1.0,  # coefficient of the contact, 0 to 1 [-]; the reference has 1
    friction: float = 0.0,  # coefficient of the contact [-]
    wall_segments: Optional[Tuple[int, ...]] = None,  # of the DEM wall [-]; none: as many, on the same places
    mapping: Literal["linear", "nearest"] = "linear",  # interface to wall; a copy where places coincide
    spread: float = 0.0,  # radius over which the force is spread [m], see docs/error_floor.md; 0: as it comes
    take_out: bool = False,  # the dent that is left under it, which Hertz's law contains
    scheme: Scheme = Scheme(dt=2e-6, t_end=4e-4, substeps=20),
    numerics: Numerics = Numerics(),
    output: Output = Output(Path("out/beam_impact")),
) -> Run:
    """Sphere on a beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz
    contact."""
    check.not_negative("spread", spread, "m")
    check.not_negative("gap", gap, "m")
    if wall_segments is not None:
        check.counts("wall_segments", wall_segments, beam.dim - 1)
    rho = beam.rho if rho_sphere is None else check.positive("rho_sphere", rho_sphere, "kg/m^3")
    theory = impact(beam.length, beam.height, beam.width, radius, v0, beam.E, beam.nu, beam.rho, scheme.t_end,
                    sphere=(beam.E, beam.nu, rho), at=at)
    beam = replace(beam, body=beam.body or BODY[beam.dim], segments=beam.segments or SEGMENTS[beam.dim])
    grid, body, supports, interface = beam.scene(LAWS[law](beam.E, beam.nu), plane, f_bar, shift)
    wall = interface if wall_segments is None else Interface.top(beam.box, wall_segments, shift)
    start, steel = [at, radius + gap - shift, 0.0], Material(beam.E, beam.nu)
    ball = Spheres([start[:beam.dim]], [[0.0, -v0, 0.0][:beam.dim]], radius, rho)
    grains = Scene(ball, Wall(wall.x, wall.elements), steel, steel, at_wall=Interaction(restitution,
                                                                                        friction))
    follow = (nearest(interface.x, wall.x) if mapping == "nearest" else
              linear(interface.x, interface.elements, wall.x))
    width = None if beam.dim == 3 else beam.width
    left = indentation_compliance(spread, beam.E, beam.nu, width, plane) if take_out else 0.0
    solid = MPM(grid, body, supports, interface, numerics=numerics)
    beside = Comparison(theory, interface, ball, wait=gap / v0)
    return Run("beam_impact", solid, grains, scheme, output, spread_over(follow, spread, left),
               beside.columns, errors=beside.errors, figure=beside.figure)


if __name__ == "__main__":
    main.run()
