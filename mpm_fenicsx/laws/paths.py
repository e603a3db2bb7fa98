"""Paths along which a single point of a material is led, see ``driver``: those of the soil laboratory.

Signs are those of mechanics, tension and lengthening positive, but for what is called ``pressure`` and
``shortening``. The axis of the apparatus is y.
"""
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Mapping, Optional

import mpm_dem_checks as check

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")
AXES = COMPONENTS[:3]
MOST = 10.0  # strain of a stage: a length becomes 22 000 times as large


@dataclass(frozen=True)
class Stage:
    """Part of a path, in which each component has either its strain or its stress prescribed.

    strain: component ("xx", …) → by how much it changes; of "xx", "yy" and "zz" logarithmic strain, of "xy"
    the slide along x over the height in y, and so on [-]. stress: component → Cauchy stress at the end [Pa],
    to which it goes linearly. A component that is in neither keeps its strain. steps: how many; time: how
    long it takes [s], None: infinitely long, without rates.

    >>> Stage(strain={"yy": -0.1}, stress={"xx": -1e5, "zz": -1e5}).steps
    100
    >>> Stage(stress={"rr": -1e5})
    Traceback (most recent call last):
    ValueError: component of the stress is 'rr': choose one of xx, yy, zz, xy, yz, xz
    """

    strain: Mapping[str, float] = field(default_factory=dict)
    stress: Mapping[str, float] = field(default_factory=dict)
    steps: int = 100
    time: Optional[float] = None

    def __post_init__(self) -> None:
        for what, given, most, unit in (("strain", self.strain, MOST, ""),
                                        ("stress", self.stress, 1e15, "Pa")):
            if not isinstance(given, Mapping):
                check.refuse(f"{what} of the stage", given, 'give a dict by component, as {"yy": -0.1}')
            for name, value in given.items():
                check.choice(f"component of the {what}", name, COMPONENTS)
                check.between(f"{what} {name}", value, -most, most, unit)
        both = sorted(set(self.strain) & set(self.stress))
        if both:
            raise ValueError(f"{both[0]} has its strain and its stress prescribed: leave one of them out")
        check.count("steps", self.steps)
        if self.time is not None:
            check.positive("time", self.time, "s", "give a positive number, or None for infinitely slow")


def _pressed(pressure: float, steps: int) -> List[Stage]:
    """Isotropic consolidation, slow, from rest."""
    check.not_negative("pressure", pressure, "Pa")
    return [Stage(stress=dict.fromkeys(AXES, -pressure), steps=steps)] if pressure > 0.0 else []


def isotropic(
    pressure: float,  # at the end [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Pressed from all sides alike.

    >>> isotropic(pressure=1e5)[0].stress["yy"]
    -100000.0
    """
    return [Stage(stress=dict.fromkeys(AXES, -check.positive("pressure", pressure, "Pa")), steps=steps,
                  time=time)]


def oedometer(
    shortening: float,  # along the axis, logarithmic [-]
    pressure: float = 0.0,  # isotropic, at the start [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Pressed along the axis, in a stiff ring."""
    return [*_pressed(pressure, steps), Stage({"yy": -shortening}, steps=steps, time=time)]


def triaxial(
    shortening: float,  # along the axis, logarithmic [-]; negative: extension
    pressure: float = 0.0,  # of the cell [Pa]; 0: uniaxial stress
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Drained: pressed from all sides, then along the axis, at a constant pressure on the sides."""
    cell = {"xx": -pressure, "zz": -pressure}
    return [*_pressed(pressure, steps), Stage({"yy": -shortening}, cell, steps, time)]


def undrained(
    shortening: float,  # along the axis, logarithmic [-]; negative: extension
    pressure: float,  # of the cell at the start [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Undrained triaxial: pressed from all sides, then along the axis at constant volume."""
    sides = {"xx": 0.5 * shortening, "yy": -shortening, "zz": 0.5 * shortening}
    return [*_pressed(pressure, steps), Stage(sides, steps=steps, time=time)]


def plane_strain(
    shortening: float,  # along the axis, logarithmic [-]
    pressure: float = 0.0,  # of the cell [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Biaxial: pressed from all sides, then along y, at a constant pressure along x and held along z."""
    return [*_pressed(pressure, steps), Stage({"yy": -shortening}, {"xx": -pressure}, steps, time)]


def plane_stress(
    shortening: float,  # along y, logarithmic [-]; negative: pulled
    pressure: float = 0.0,  # along x and, at first, along y [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """A sheet: pressed in its plane, then along y, at a constant pressure along x and none across."""
    check.not_negative("pressure", pressure, "Pa")
    first = [Stage(stress={"xx": -pressure, "yy": -pressure, "zz": 0.0}, steps=steps)] if pressure else []
    return [*first, Stage({"yy": -shortening}, {"xx": -pressure, "zz": 0.0}, steps, time)]


def simple_shear(
    shear: float,  # slide along x over the height [-]
    pressure: float = 0.0,  # isotropic, at the start [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Sheared at constant volume."""
    return [*_pressed(pressure, steps), Stage({"xy": shear}, steps=steps, time=time)]


def direct_shear(
    shear: float,  # slide along x over the height [-]
    pressure: float,  # along y, kept; at the start from all sides [Pa]
    steps: int = 100,  # in each stage
    time: Optional[float] = None,  # of loading [s]; none: slowly
) -> List[Stage]:
    """Sheared at a constant pressure on the top, held along x and z, as in a shear box."""
    return [*_pressed(pressure, steps), Stage({"xy": shear}, {"yy": -pressure}, steps, time)]


def _to_and_fro(amplitude: Mapping[str, float], cycles: int, more: Stage) -> List[Stage]:
    """Stages of ``cycles``: out, through zero to the other side, and back to zero."""
    turns = [Stage({name: share * size for name, size in amplitude.items()}, more.stress, more.steps,
                   more.time and abs(share) * more.time) for share in (1.0, -2.0, 1.0)]
    return turns * check.count("cycles", cycles)


def cyclic(
    shortening: float,  # amplitude along the axis, logarithmic [-]
    pressure: float = 0.0,  # of the cell [Pa]
    cycles: int = 3,  # how many
    steps: int = 100,  # in each stage, three in a cycle
    time: Optional[float] = None,  # of a quarter of a cycle [s]; none: slowly
) -> List[Stage]:
    """Triaxial: pressed and pulled along the axis, at a constant pressure on the sides."""
    cell = {"xx": -pressure, "zz": -pressure}
    return [*_pressed(pressure, steps),
            *_to_and_fro({"yy": -shortening}, cycles, Stage(stress=cell, steps=steps, time=time))]


def cyclic_shear(
    shear: float,  # amplitude of the slide along x over the height [-]
    pressure: float = 0.0,  # isotropic, at the start [Pa]
    cycles: int = 3,  # how many
    steps: int = 100,  # in each stage, three in a cycle
    time: Optional[float] = None,  # of a quarter of a cycle [s]; none: slowly
) -> List[Stage]:
    """Sheared to and fro at constant volume."""
    return [*_pressed(pressure, steps),
            *_to_and_fro({"xy": shear}, cycles, Stage(steps=steps, time=time))]


PATHS: Dict[str, Callable[..., List[Stage]]] = {
    path.__name__: path for path in (isotropic, oedometer, triaxial, undrained, plane_strain, plane_stress,
                                     simple_shear, direct_shear, cyclic, cyclic_shear)}
