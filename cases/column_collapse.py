"""A column of dry granular material collapses and runs out: the soil of the third example of Singer et al. 2022, alone.

    python cases/column_collapse.py                               a minute, with cells of 1 cm
    python cases/column_collapse.py preset=paper                  the paper's grid and time step
    python cases/column_collapse.py aspect=4 phi=30 floor=0.4     a slender column on a floor that it rubs on
    python cases/column_collapse.py dim=3 h=0.025 dt=1e-3         in space, between side walls
"""
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, Optional, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Record, Steps, cli, count_windows, march
from coupling.keys import refuse_unused
from coupling.pictures import figure, frames
from mpm_fenicsx import LAWS, MPM, SOLVERS, Body, Box, Grid, GridWall, Numerics, Support, at_rest

PRESETS = {"paper": dict(h=0.005, dt=5e-5)}
TIMES = 0.0, 0.10, 0.25, 0.30, 0.36, 0.40, 0.45  # [s] of the pictures, from the third on those of the paper
POINTS = {"triangle": 3, "quadrilateral": 2, "tetrahedron": 4, "hexahedron": 2}  # per body cell, unless others are asked for


def main(
    dim: Literal[2, 3] = 2,  # in the plane (plane strain) or in space
    width: float = 0.10,  # of the column, which leans against a smooth wall at x = 0 [m]
    aspect: float = 2.0,  # height of the column over its width [-]
    depth: float = 0.20,  # of the column in space [m]
    open_side: bool = False,  # in space: no wall at its front side, so that it runs out in both directions
    law: Literal["mohr_coulomb", "drucker_prager", "von_mises"] = "mohr_coulomb",  # of the soil
    E: float = 50e3,  # Young's modulus [Pa]
    nu: float = 0.4,  # Poisson's ratio [-]
    rho: float = 1300.0,  # density [kg/m^3]
    phi: float = 22.0,  # friction angle [degrees]
    psi: float = 0.0,  # dilation angle [degrees]
    cohesion: float = 0.0,  # [Pa]; of von_mises: its strength in shear
    tension: Optional[float] = None,  # greatest tension [Pa]; none: up to the apex of the yield surface
    g: float = 9.81,  # gravity [m/s^2]
    initial: Literal["zero", "geostatic"] = "zero",  # stress at the start: none, or in equilibrium with the weight above
    ratio: Optional[float] = None,  # of horizontal to vertical stress then [-]; none: 1 - sin phi
    floor: str = "stick",  # stick, slip, or a coefficient of friction
    h: float = 0.01,  # size of the background cells [m]
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None,  # of the grid
    box: Optional[Tuple[float, ...]] = None,  # size of the grid [m]; none: as far as free fall throws, a quarter higher
    body_cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None,  # none: triangle, hexahedron
    refine: Optional[int] = None,  # body cells per background cell and direction [-]; none: 2, in space 1
    points: Optional[int] = None,  # material points per body cell: in all (simplices) or per direction [-]; none: 3, 2, 4, 2
    f_bar: bool = True,  # average the volume change over each background cell, against locking
    inertia: Literal["lumped", "consistent", "ghost"] = "lumped",  # in the solve; ghost: consistent with a ghost penalty
    dt: float = 5e-4,  # time step [s]
    t_end: float = 0.5,  # end of the run [s]
    outflow: Literal["stop", "hold", "remove"] = "remove",  # of soil at open sides of the grid; stop: that ends the run
    solver: Literal[SOLVERS] = "auto",  # of the linear systems, see docs/solvers.md; -mpm_… options win over it
    rebalance: float = 1.2,  # imbalance of material points over the ranks that calls for a new partition [-]
    out: Path = Path("out/column_collapse"),  # folder of the results
    paraview: int = 0,  # steps from one ParaView file to the next [-]; 0: none
) -> dict:
    """Collapse of a granular column: front, energies and volume over time, pictures at the paper's times."""
    keys = dict(locals())
    soil, space = (law != "von_mises", "for soil, not for law=von_mises"), (dim == 3, "in space, dim=3")
    refuse_unused(main, keys, {"ratio": (initial == "geostatic", "with initial=geostatic"), "depth": space,
                               "open_side": space, "phi": soil, "psi": soil, "tension": soil})
    p = SimpleNamespace(**keys, height=aspect * width, thickness=1.0)
    steps = count_windows(t_end, dt)
    solid = make_column(p)
    flow = Flow(solid, p)
    with Record("column_collapse", keys, out, solid, None, windows=steps, columns=flow.columns(),
                paraview=paraview, pictures=flow.pictures("column_collapse_flow")) as record:
        march(solid, Steps(dt, t_end), on_window=[flow, record])
        record.finish(compare(record.history, p), lambda path: draw(path, record.history))
    solid.close()
    return record.history


def make_column(p, surface=None):
    """The MPM of the keys ``p``: grid, soil, floor and walls; surface: from the ``Body`` to its ``Interface``."""
    for name, unit in (("width", "m"), ("aspect", ""), ("depth", "m"), ("h", "m")):
        check.positive(name, getattr(p, name), unit)
    check.positive("g", p.g, "m/s^2", "without gravity nothing collapses, give a positive number")
    if p.refine is not None:
        check.count("refine", p.refine)
    size = np.array([p.width, p.height, p.depth][:p.dim])
    grid = make_grid(p, size)
    kind = p.body_cell or ("triangle" if p.dim == 2 else "hexahedron")
    cells = tuple(n * (p.refine or (2 if p.dim == 2 else 1)) for n in Grid.counts(size, p.h))
    body = Body(Box((0.0,) * p.dim, tuple(size)), cells, POINTS[kind] if p.points is None else p.points, make_law(p), p.rho, cell=kind,
                thickness=p.thickness, f_bar=p.f_bar, stress=initial_stress(p))
    supports, walls = make_floor(p.floor, p.h, p.dim)
    supports.append(Support.column("x", 0.0, grid, "x", name="the wall"))
    for z, there in ((0.0, True), (p.depth, not p.open_side)):
        if p.dim == 3 and there:
            supports.append(Support.column("z", z, grid, "z", name=f"the side wall at z = {z} m"))
    return MPM(grid, body, supports, surface and surface(body), gravity=(0.0, -p.g, 0.0)[:p.dim], inertia=p.inertia,
               penalties=walls, numerics=Numerics(p.solver, p.rebalance),
               outflow={side: p.outflow for side in ("+x", "+y", "+z")[:p.dim] if side != "+z" or p.open_side})


def make_grid(p, size):
    """Background grid of cells of size h for a column of ``size`` [m]."""
    if p.box is None:
        far = math.sqrt(2 * p.g * p.height) * p.t_end
        box = [p.width + far, 1.25 * p.height, p.depth + far * p.open_side]
    else:
        box = check.numbers("box", p.box, p.dim, "m", check.positive)
        if any(length < (1 - 1e-9) * least for length, least in zip(box, size)):
            raise ValueError(f"box is {cli.typed(p.box)} m: it must hold the column of {cli.typed(tuple(size))} m")
    counts = Grid.counts(size, p.h)
    h = size / counts
    cells = [max(math.ceil(length / each - 1e-9), n) for length, each, n in zip(box, h, counts)]
    for d in range(3 if p.open_side else 2)[:p.dim]:  # the flow needs a way out, the column must not touch the top
        cells[d] += cells[d] == counts[d]
    return Grid(Box((0.0,) * p.dim, tuple(np.array(cells) * h)), tuple(cells), p.cell)


def initial_stress(p):
    """For the key ``initial``; without a given ratio that of Jaky (1944)."""
    if p.initial == "zero":
        return None
    return at_rest(p.height, p.rho, p.g, 1.0 - math.sin(math.radians(p.phi)) if p.ratio is None else p.ratio)


def make_law(p):
    if p.law == "von_mises":
        check.positive("cohesion", p.cohesion, "Pa", "law=von_mises has its strength from it, give a positive number")
        return LAWS["von_mises"](p.E, p.nu, math.sqrt(3.0) * p.cohesion)  # yields in pure shear at the cohesion
    check.between("phi", p.phi, 0, 90, "degrees", "the friction angle must be at least 0 and less than 90", "[)")
    check.between("psi", p.psi, 0, p.phi, "degrees", f"the dilation angle must lie from 0 to phi, {p.phi:g}")
    more = dict(match="plane_strain" if p.dim == 2 else "compression") if p.law == "drucker_prager" else {}
    return LAWS[p.law](p.E, p.nu, p.phi, p.psi, p.cohesion, p.tension, **more)


def make_floor(kind, h, dim):
    """Supports and walls for the key ``floor``."""
    on_floor = lambda x: x[:, 1] < 0.25 * h  # noqa: E731
    if kind in ("stick", "slip"):
        return [Support(on_floor, "xyz"[:dim] if kind == "stick" else "y", name="the floor")], []
    try:
        friction = cli.convert("floor", kind, float)
    except cli.UsageError:
        raise ValueError(f"floor is {kind!r}: give stick, slip or a coefficient of friction") from None
    check.not_negative("floor", friction, rule="give stick, slip or a coefficient of friction of at least 0")
    return [], [GridWall(lambda x: np.abs(x[:, 1]) < 0.25 * h, "+y", friction, name="the floor")]


class Flow:
    """What the history and the pictures show of the column, step by step: an observer to be called before the
    ``Record``. Collective."""

    def __init__(self, solid, p):
        self._solid, self._points, self._last = solid, solid.points, 0.0
        self._times, self._frames = [t for t in TIMES if t < p.t_end + 0.5 * p.dt], []
        self._box = solid.grid.box
        self._picture(0.0)

    def columns(self):
        """For the ``Record``."""
        shown = {"front": ("m", "largest x of a material point"), "x99": ("m", "99 % quantile of x of the points"),
                 "height": ("m", "largest height of a material point"),
                 "speed": ("m/s", "largest speed of a material point"),
                 "kinetic": ("J", "kinetic energy (plane: per metre)"),
                 "potential": ("J", "potential energy, zero at the floor"), "elastic": ("J", "elastic energy"),
                 "energy": ("J", "sum of the three"), "volume": ("m^3", "volume of the material points as deformed"),
                 "gaps": ("m^3", "of it what has opened between soil that separated")}
        return {name: (*meaning, lambda _, name=name: self.now[name]) for name, meaning in shown.items()}

    def __call__(self, step):
        energy, (x, speed) = self._solid.energy(), self._gathered()
        volume = self._solid.parts[0].volume()
        gaps = volume @ -np.expm1(-self._solid.points.state["opened"])
        volume, gaps = self._solid.comm.allreduce(np.array([volume.sum(), gaps]))
        self.now = dict(front=x[:, 0].max(), x99=np.quantile(x[:, 0], 0.99), height=x[:, 1].max(), speed=speed.max(),
                        kinetic=energy["kinetic"], potential=energy["potential"], elastic=energy["strain"],
                        energy=sum(energy.values()), volume=volume, gaps=gaps)
        if self._times and step.time > self._times[0] - 0.5 * step.dt:
            self._picture(step.time)

    def _gathered(self):
        """Positions [m], shape (n, dim), and speeds [m/s], shape (n,), of all points, on every rank."""
        p, comm = self._solid.points, self._solid.comm
        speed = np.sqrt(np.einsum("pi,pi->p", p.v, p.v))
        if comm.size == 1:
            return p.x, speed
        parts = comm.allgather((p.x, speed))
        return tuple(np.concatenate(values) for values in zip(*parts))

    def _picture(self, time):
        self._times = [t for t in self._times if t > time + 1e-12]
        x, speed = self._gathered()
        self._frames.append((f"t = {time:.2f} s", x.copy(), speed.copy()))

    def pictures(self, name):
        """Of the points by speed at the times so far, for the ``Record``."""
        return {f"{name}.png": lambda path: frames.draw(path, self._frames, "speed [m/s]", walls=("-y", "-x", "-z"))}


def compare(history, p):
    """Largest rise of the energy from step to step and growth of the volume, with and without the gaps, relative to the
    start; largest speed over that of free fall from the top; arrival of the 99 % quantile at x = 30 cm after the paper's
    0.25 s, relative."""
    start = p.rho * p.g * p.width * p.height**2 / 2 * (1.0 if p.dim == 2 else p.depth)
    volume = p.width * p.height * (1.0 if p.dim == 2 else p.depth)
    energy = np.concatenate([[start], history["energy"]])
    errors = {"energy_rise": np.diff(energy).max() / start, "volume": history["volume"].max() / volume - 1.0,
              "soil": (history["volume"] - history["gaps"]).max() / volume - 1.0,
              "speed": history["speed"].max() / math.sqrt(2 * p.g * p.height)}
    there = history["x99"] >= 0.3
    if (p.width, p.aspect) == (0.1, 2.0) and there.any():
        errors["arrival"] = history["time"][np.argmax(there)] / 0.25 - 1.0
    return {name: float(error) for name, error in errors.items()}


def draw(path, history):
    """Front and energies over time."""
    t = history["time"]
    front = [(t, 100 * history["front"], "largest x", "run"), (t, 100 * history["x99"], "99 % quantile of x", "run"),
             (t, 100 * history["height"], "largest height", "run")]
    energy = [(t, history[name], name, "run") for name in ("potential", "kinetic", "elastic")]
    energy.append((t, history["energy"], "sum", "reference"))
    figure.draw(path, "time [s]", {"front and top [cm]": front, "energy [J]": energy})


if __name__ == "__main__":
    cli.run(main, PRESETS)
