"""Soil from its peak to its residual strength, of two laws with either."""
from functools import partial
from typing import Dict, Optional

import mpm_dem_checks as check

from . import soft_cone, soft_pyramid
from .law import Law
from .softening import Softens, softening_law

SOFTENS: Dict[str, Softens] = {"mohr_coulomb": soft_pyramid.SOFTENS, "drucker_prager": soft_cone.SOFTENS}
# Numbers of both that must be the same, and those that may only fall, with what the user knows them by.
ALIKE = ("lam", "mu", "viscosity")
FALL = {"N": "friction_angle", "M": "dilation_angle", "S": "cohesion", "eta": "friction_angle",
        "etab": "dilation_angle", "xi": "cohesion"}


def _check(peak: Law, residual: Law) -> None:
    for name, law in (("peak", peak), ("residual", residual)):
        check.record(name, law, Law)
        if law.name not in SOFTENS:
            raise ValueError(f"{name} is the law {law.name}: give one of {', '.join(SOFTENS)}")
    if peak.name != residual.name:
        raise ValueError(f"peak is the law {peak.name}, residual {residual.name}: give the same law twice")
    for name, one, other in zip(peak.params._fields, peak.params, residual.params):
        if name in ALIKE and one != other:
            raise ValueError(f"{name} is {one:.6g} of the peak and {other:.6g} of the residual soil: give "
                             "both the same E, nu and viscosity, only strength is lost")
        if name in FALL and other > one * (1.0 + 1e-12):
            raise ValueError(f"{FALL[name]} of the residual soil is above that of the peak ({name} is "
                             f"{other:.6g} and {one:.6g}): give at most that, strength is lost")


def softened(peak: Law, residual: Law, strain: float, length: float, cell: Optional[float] = None) -> Law:
    """Soil that goes from the strength of ``peak`` to that of ``residual``, both ``mohr_coulomb`` or both
    ``drucker_prager``, as it shears plastically by ``strain`` [-] in a band of width ``length`` [m], see
    ``softening``. The law remembers ``plastic_strain``. ``cell``: size of the background cells [m], the width
    of a band on the grid; None: ``MPM`` takes that of its grid (of cells that are not square or cubes the
    geometric mean), and a single point is a sample as wide as ``length``. Raises ValueError for impossible
    values, and where ``cell`` is so large that strength is lost faster than the soil unloads.

    A band of clay, 5 cm wide, that loses half of its cohesion over a slip of 5 mm:

    >>> from mpm_fenicsx import mohr_coulomb
    >>> peak, residual = (mohr_coulomb(E=10e6, nu=0.3, friction_angle=20.0, cohesion=c) for c in (2e4, 1e4))
    >>> law = softened(peak, residual, strain=0.1, length=0.05, cell=0.2)
    >>> round(law.params.full * 3**0.5 * 0.2, 6)  # slip of a band on the grid [m]
    0.005
    """
    _check(peak, residual)
    strain = check.positive("strain of softening", strain, rule="give the plastic shear strain at which the "
                            "strength is residual, a positive number")
    length = check.positive("length of softening", length, "m", "give the width of the band that the strain "
                            "belongs to, a positive number")
    if cell is not None:
        cell = check.positive("cell of softening", cell, "m", "give the size of the background cells, a "
                              "positive number, or leave it out")
    law = softening_law(peak, residual, strain, length, cell, SOFTENS[peak.name])
    return law._replace(cell=cell, by_cell=partial(softened, peak, residual, strain, length))
