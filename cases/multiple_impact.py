"""A steel sphere strikes a long, simply supported beam three times: the second example of Singer et al. 2022.

    python cases/multiple_impact.py                               seconds, with the built-in DEM
    python cases/multiple_impact.py dim=3                         the beam in space
    python cases/multiple_impact.py dem=liggghts preset=paper     the paper's discretisation and time step
"""
from pathlib import Path
from typing import Literal, Optional, Tuple

import beam_impact

from coupling import analytic, cli
from coupling.keys import refuse_unused
from mpm_fenicsx import SOLVERS

PRESETS = {"paper": dict(cells=(124, 13), body=(240, 8), points=4, segments=(240,), dt=5e-8, substeps=1, t_end=4e-3)}
MODES = 500  # of the reference: with 50 the third peak is off by 0.5 %


def main(
    dim: Literal[2, 3] = 2,  # in the plane or in space
    length: float = 0.307,  # of the beam [m]
    radius: float = 0.02,  # of the sphere [m]
    v0: float = 0.01,  # impact speed [m/s]
    E: float = 215.82e9,  # Young's modulus of beam and sphere [Pa]
    nu: float = 0.289,  # Poisson's ratio of both [-]
    rho: float = 7960.0,  # density of both [kg/m^3]
    h: float = 2e-3,  # size of the background cells, of which columns stand at the beam's ends [m]
    cells: Optional[Tuple[int, ...]] = None,  # of the grid along, up (3 beam heights) and across [-]; replaces h
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None,  # of grid and body
    body: Optional[Tuple[int, ...]] = None,  # body cells along, up and across [-]; none: 240,8 or 160,5,5
    points: int = 2,  # material points per body cell: in all (triangle, tetrahedron) or per direction (others) [-]
    segments: Optional[Tuple[int, ...]] = None,  # of the interface on top, along and across [-]; none: 240 or 240,8
    dt: float = 2e-6,  # coupling window and MPM time step [s]
    substeps: int = 20,  # DEM steps per window [-]
    iterate: int = 0,  # most repetitions of a window until both sides agree [-]; 0: weak coupling
    tol: float = 1e-4,  # how well they agree, as a part of the force [-]
    relax: Literal["aitken", "constant", "iqn"] = "aitken",  # how the force is corrected in a repetition
    adapt: Optional[float] = 0.0,  # shorter windows; none: never, 0: where one fails, 0.01: also for that error [-]
    t_end: float = 4e-3,  # end of the run [s]
    solver: Literal[SOLVERS] = "auto",  # of the linear systems, see docs/solvers.md; -mpm_… options win over it
    dem: Literal["reference", "liggghts", "compare"] = "reference",  # back end; compare runs both
    out: Path = Path("out/multiple_impact"),  # folder of the results
    paraview: int = 0,  # windows from one ParaView file to the next [-]; 0: none
    picture: float = 0.0,  # magnification of the displacements in a picture of the end [-]; 0: no picture
) -> dict:
    """Sphere on a long beam of 1 cm x 1 cm, supported at both ends, against the Timoshenko beam with Hertz contact."""
    keys = dict(locals())
    refuse_unused(main, keys, {name: use for name, use in beam_impact.uses(keys).items() if name in keys})
    keys["body"] = body or {2: (240, 8), 3: (160, 5, 5)}[dim]
    keys["segments"] = segments or {2: (240,), 3: (240, 8)}[dim]
    return beam_impact.strike("multiple_impact", compare, modes=MODES, **keys)


def compare(runs, reference, wait):
    """Errors of the last of ``runs``: those of the single impact; number of contacts too many; start, end and peak of
    each contact, relative (start of the first: as part of its duration)."""
    *_, history = runs.values()
    errors = beam_impact.compare(runs, reference, wait)
    ours, theirs = analytic.contacts(history["time"], history["force"]), reference.contacts()
    errors["contacts"] = float(len(ours) - len(theirs))
    for number, (own, other) in enumerate(zip(ours, theirs), 1):
        errors |= {f"start_{number}": abs(own.start - other.start) / (other.start or other.end),
                   f"end_{number}": abs(own.end / other.end - 1), f"peak_{number}": abs(own.peak / other.peak - 1)}
    return errors


if __name__ == "__main__":
    cli.run(main, PRESETS)
