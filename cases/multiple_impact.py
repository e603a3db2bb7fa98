"""A steel sphere strikes a long, simply supported beam three times: the second example of Singer et al. 2022.

    python cases/multiple_impact.py                               seconds, with the built-in DEM
    python cases/multiple_impact.py dim=3                         the beam in space
    python cases/multiple_impact.py dem=liggghts preset=paper     the paper's discretisation and time step
"""
from dataclasses import replace
from pathlib import Path

from coupling import Output, Run, Scheme, case
from dem_liggghts import Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Numerics, SimplySupportedBeam, linear
from references.beam_theory import impact
from references.sphere_on_beam import Comparison

PRESETS = {"paper": dict(cells=(124, 13), body=(240, 8), points=4, segments=(240,), dt=5e-8, substeps=1,
                         t_end=4e-3)}
BODY, SEGMENTS = {2: (240, 8), 3: (160, 5, 5)}, {2: (240,), 3: (240, 8)}  # unless others are asked for
MODES = 500  # of the reference: with 50 the third peak is off by 0.5 %


@case(presets=PRESETS)
def main(
    beam: SimplySupportedBeam = SimplySupportedBeam(length=0.307),
    radius: float = 0.02,  # of the sphere [m]; it is of the material of the beam
    v0: float = 0.01,  # impact speed [m/s]
    scheme: Scheme = Scheme(dt=2e-6, t_end=4e-3, substeps=20),
    numerics: Numerics = Numerics(),
    output: Output = Output(Path("out/multiple_impact")),
) -> Run:
    """Sphere on a long beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz
    contact."""
    theory = impact(beam.length, beam.height, beam.width, radius, v0, beam.E, beam.nu, beam.rho, scheme.t_end,
                    modes=MODES)
    beam = replace(beam, body=beam.body or BODY[beam.dim], segments=beam.segments or SEGMENTS[beam.dim])
    grid, body, supports, interface = beam.scene(linear(beam.E, beam.nu))
    start, steel = [0.0, radius, 0.0], Material(beam.E, beam.nu)
    ball = Spheres([start[:beam.dim]], [[0.0, -v0, 0.0][:beam.dim]], radius, beam.rho)
    grains = Scene(ball, Wall(interface.x, interface.elements), steel, steel)
    solid = MPM(grid, body, supports, interface, numerics=numerics)
    beside = Comparison(theory, interface, ball)
    return Run("multiple_impact", solid, grains, scheme, output, columns=beside.columns,
               errors=beside.errors_of_contacts, figure=beside.figure)


if __name__ == "__main__":
    main.run()
