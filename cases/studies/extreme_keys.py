"""Keys of ``extreme.py``: groups of typed fields, what they are in SI units, and which of them make no
sense."""
import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Callable, Literal, Optional, Tuple

import numpy as np

import mpm_dem_checks as check
from mpm_fenicsx import Numerics

ALONE = ("swing", "flight")  # scenes without a sphere
POSITIVE = {"length": "m", "height": "m", "width": "m", "radius": "m", "E": "Pa", "E_ball": "Pa",
            "rho": "kg/m^3", "contrast": "", "mass_ratio": "", "h": "m", "dt": "s", "cfl": "",
            "per_contact": ""}
DIMENSION = {  # powers of length, time and mass in the keys that have any
    **dict.fromkeys(("length", "height", "width", "radius", "h", "shift", "gap", "at", "spread"),
                    (1, 0, 0)),
    **dict.fromkeys(("v0", "fly"), (1, -1, 0)), **dict.fromkeys(("E", "E_ball"), (-1, -2, 1)),
    "rho": (-3, 0, 1), "gravity": (1, -2, 0), "dt": (0, 1, 0)}


@dataclass(frozen=True)
class Block:
    """The elastic body."""

    length: float = 0.1535  # of the body [m]
    height: float = 0.01  # of the body [m]
    width: float = 0.01  # of the body, across the plane [m]
    E: float = 215.82e9  # Young's modulus of the body [Pa]
    contrast: float = 1.0  # of the modulus over that of the layer below [-]
    nu: float = 0.289  # Poisson's ratio of all [-]
    rho: float = 7960.0  # density of the body [kg/m^3]
    law: Literal["linear", "neo_hooke"] = "linear"  # of the body
    plane: Literal["stress", "strain"] = "stress"  # plane state (dim=2)
    fly: float = 0.0  # velocity of the body along the grid at the start [m/s]

    @property
    def mass(self) -> float:
        """In all [kg]."""
        return self.rho * self.length * self.height * self.width


@dataclass(frozen=True)
class Ball:
    """The spheres and their contact."""

    radius: float = 0.01  # of the sphere [m]
    v0: float = 0.01  # speed of the impact, or of the vibration of a body alone [m/s]
    angle: float = 0.0  # of the impact, away from the vertical [deg]
    at: Tuple[float, ...] = (0.0,)  # places of the spheres along the body, 0: its middle [m]
    E_ball: Optional[float] = None  # Young's modulus of the sphere [Pa]; none: as the body
    mass_ratio: Optional[float] = None  # mass of the sphere over that of the body [-]; none: of equal density
    gravity: float = 0.0  # on the spheres, downward [m/s^2]
    gap: float = 0.0  # between sphere and body at the start [m]
    restitution: float = 1.0  # of the contact [-]
    friction: float = 0.0  # of the contact [-]
    spread: float = 0.0  # radius of the spread contact force [m], see docs/error_floor.md; 0: as it comes
    take_out: bool = False  # the dent that is left under it, which Hertz's law contains


@dataclass(frozen=True)
class Resolution:
    """Cells, material points and boundary particles."""

    h: float = 5e-3  # size of the background cells [m]
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None  # of both
    refine: int = 1  # body cells per background cell and direction [-]
    points: int = 3  # material points per body cell: per direction, or in all for simplices [-]
    seeding: Literal["gauss", "random", "corner"] = "gauss"  # corner: one more point, alone in a cell
    f_bar: bool = False  # average the volume change over each cell
    shift: float = 0.0  # of the interface into the body, negative: out of it [m]
    inertia: Literal["consistent", "lumped"] = "consistent"  # in the solve


@dataclass(frozen=True)
class Windows:
    """Coupling windows, whose length and number of DEM steps the scene may give."""

    dt: Optional[float] = None  # coupling window [s]; none: by cfl or per_contact
    cfl: Optional[float] = None  # coupling window over the explicit limit, h over the wave speed [-]
    per_contact: float = 50.0  # coupling windows in the time of a Hertz contact [-]
    windows: int = 120  # their number [-]
    substeps: Optional[int] = None  # DEM steps per window [-]; none: of half the DEM's critical step
    iterate: int = 0  # repetitions of a window, at most, until both sides agree [-]; 0: weak coupling
    adapt: Optional[float] = 0.0  # shorter windows; none: never, 0: where one fails; see couple()
    dem: Literal["reference", "liggghts"] = "reference"  # back end


@dataclass(frozen=True)
class Extreme:
    """All of a run. ``unit``: in which its numbers are given [m, s, kg]."""

    scene: str
    dim: int
    block: Block
    ball: Ball
    resolution: Resolution
    windows: Windows
    unit: Tuple[float, float, float]
    numerics: Numerics = Numerics()

    @property
    def keys(self) -> dict:
        """Name → value, without groups."""
        groups = (self.block, self.ball, self.resolution, self.windows, self.numerics)
        return {"scene": self.scene, "dim": self.dim, "unit": self.unit,
                **{name: value for group in groups for name, value in asdict(group).items()}}

    @property
    def dt(self) -> float:
        """Of a window [s], once it is known."""
        assert self.windows.dt is not None
        return self.windows.dt

    @property
    def E_ball(self) -> float:
        """Young's modulus of the spheres [Pa]."""
        return self.block.E if self.ball.E_ball is None else self.ball.E_ball

    @property
    def density(self) -> float:
        """Of the spheres [kg/m^3]."""
        ratio = self.ball.mass_ratio
        return self.block.rho if ratio is None else ratio * self.block.mass / self._volume

    @property
    def ball_mass(self) -> float:
        """Of a sphere [kg]."""
        return self.density * self._volume

    @property
    def _volume(self) -> float:
        return 4 / 3 * np.pi * self.ball.radius**3

    @property
    def stiffness(self) -> float:
        """Of the Hertz contact [N/m^1.5]."""
        block, ball = self.block, self.ball
        return 4 / 3 * np.sqrt(ball.radius) / ((1 - block.nu**2) * (1 / block.E + 1 / self.E_ball))

    def in_si(self) -> "Extreme":
        """The same in SI units."""
        si = lambda group: _scaled(group, self.unit)
        return replace(self, block=si(self.block), ball=si(self.ball), resolution=si(self.resolution),
                       windows=si(self.windows))


def _scaled(group: Any, unit: Tuple[float, float, float]) -> Any:
    """A group of keys, given in ``unit``, in SI units."""
    found = {}
    for name in (f.name for f in fields(group) if f.name in DIMENSION):
        value, factor = getattr(group, name), float(np.prod(np.power(unit, DIMENSION[name])))
        if value is not None:
            found[name] = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
    return replace(group, **found)


def _not_in(*scenes: str) -> Callable[[dict], bool]:
    return lambda keys: keys["scene"] not in scenes


def _timed(keys: dict) -> bool:
    return keys["dt"] is not None or keys["cfl"] is not None


COUNTS = {  # key → (whether it has an effect beside the others, when it has one), see ``coupling.case``
    **dict.fromkeys(("at", "gap", "restitution", "friction", "gravity", "spread", "substeps"),
                    (_not_in(*ALONE), "in scenes with a sphere")),
    **dict.fromkeys(("radius", "E_ball", "mass_ratio"),  # else its contact gives the length of a window
                    (lambda keys: keys["scene"] not in ALONE or not _timed(keys), "in scenes with a sphere")),
    "angle": (_not_in("rest", *ALONE), "where a sphere strikes"),
    "v0": (_not_in("rest"), "where something moves"),
    "take_out": (lambda keys: keys["spread"] > 0, "with spread="),
    "contrast": (lambda keys: keys["scene"] == "layers", "in scene=layers"),
    "plane": (lambda keys: keys["dim"] == 2, "in the plane, dim=2"),
    "cfl": (lambda keys: keys["dt"] is None, "without dt="),
    "per_contact": (lambda keys: not _timed(keys), "without dt= and cfl=")}


def check_keys(keys: dict) -> None:
    """ValueError for a key out of its range, and a body of too many cells. keys: name → value."""
    for name, unit in POSITIVE.items():
        if keys[name] is not None:
            check.positive(name, keys[name], unit)
    for name in ("refine", "windows", "substeps"):
        if keys[name] is not None:
            check.count(name, keys[name])
    for name, unit in (("v0", "m/s"), ("gravity", "m/s^2"), ("gap", "m"), ("friction", ""), ("spread", "m")):
        check.not_negative(name, keys[name], unit)
    check.numbers("unit", keys["unit"], 3, kind=check.positive)
    check.between("nu", keys["nu"], -1, 0.5, ends="()")
    check.between("restitution", keys["restitution"], 0, 1)
    check.between("angle", keys["angle"], -90, 90, "degrees", ends="()")
    check.between("shift", keys["shift"], -math.inf, keys["height"], "m", "it must be less than the height",
                  "[)")
    _check_scene(keys)
    _check_body(keys)


def _check_scene(keys: dict) -> None:
    scene, beyond = keys["scene"], keys["length"] / 2 + keys["radius"]
    for place in check.numbers("at", keys["at"], len(keys["at"]), "m"):
        check.between("at", place, -beyond, beyond, "m",
                      f"a sphere must lie within {beyond:.6g} m of the body's middle to touch it", "()")
    if scene == "rest":
        check.positive("gravity", keys["gravity"], "m/s^2",
                       "in scene=rest the sphere lies by its weight, give a positive number")
    elif scene != "flight":
        check.positive("v0", keys["v0"], "m/s", "something must move, give a positive number")
    elif not _timed(keys):
        check.positive("v0", keys["v0"], "m/s",
                       "give a positive number, or cfl or dt for the length of a window")


def _check_body(keys: dict) -> None:
    size = [keys["length"], keys["height"], keys["width"]][:keys["dim"]]
    check.between("h", keys["h"], 0, min(size), "m",
                  f"the cell size must lie between 0 and {min(size):.6g} m", "(]")
    n = math.prod(length / keys["h"] for length in size)
    check.check_memory(f"{n:.3g} cells of the body (h={keys['h']:g}, length={keys['length']:g})", 600 * n,
                       "take a larger h, or a shorter body")
