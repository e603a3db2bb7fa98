"""The observer of a run that makes its maps."""
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import numpy as np
from mpi4py import MPI

from ..loop.window import Window
from ..shapes import motion_of
from . import kernels
from .chart import Chart, Shown
from .flow import FlowMap
from .maps import Maps
from .places import Places
from .raster import Ground, Raster, raster_over, write_grid, write_table
from .rocks import Rocks

LARGEST = {  # name of the file → (unit, meaning)
    "depth_max": ("m", "largest depth of the flow"),
    "speed_max": ("m/s", "largest speed of the flow, mean over its depth"),
    "pressure_max": ("Pa", "largest impact pressure of the flow, density times square of the speed"),
    "arrival": ("s", "time at which the flow arrived"),
    "rock_energy_max": ("J", "largest kinetic energy of a rock that covered the cell"),
    "deposit": ("m", "depth of the flow at the end")}


class MapWatch:
    """Of ``maps``, of the run of a ``solid`` and ``grains`` or None; made when both are at their start.
    Rasters and paths are complete on rank 0 alone. Collective."""

    def __init__(self, maps: Maps, solid: Any, grains: Any, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self._maps, self._solid, self._grains = maps, solid, grains
        self._ground = Ground(maps.terrain, motion_of(maps.terrain, solid, grains))
        self._ground.go(solid.time)
        self.raster: Raster = raster_over(self._ground, maps.cell)
        self._dim, bodies = len(self.raster.lower) + 1, self._bodies()
        self._time, self._due, self._goes_on = solid.time, False, False
        self._times: List[float] = []
        self.flow = FlowMap(self.raster, bodies, maps, solid.time, comm)
        self.places = Places(maps, self.flow.dry, comm)
        self.places.look(bodies, self.flow.inside, solid, 0.0)
        self._release = self.flow.depth
        self.rocks = Rocks(grains, self._ground, self._dim) if grains is not None else None
        self._energy = np.zeros(self.raster.shape)
        self._heights: Optional[np.ndarray] = None
        self._take(solid.time)

    def _bodies(self) -> List[Any]:
        """The points that flow."""
        every = self._solid.matter()
        return every if self._maps.bodies is None else [every[n] for n in self._maps.bodies]

    def __call__(self, window: Window) -> None:
        """A window has ended."""
        bodies, self._time = self._bodies(), window.time
        inside = self.flow.look(bodies, window.time)
        self.places.look(bodies, inside, self._solid, window.dt)
        if self.rocks is not None:
            self._ground.go(window.time)
            self.rocks.look()
            self._follow_rocks(self.rocks)
        if self._is_due(window):
            self._take(window.time)

    def _follow_rocks(self, rocks: Rocks) -> None:
        rocks.follow()
        x, radius = rocks.spheres
        kernels.mark_discs(x, radius, rocks.motion.energy[rocks.owner] * (radius > 0.0), self.raster.lower,
                           self.raster.cell, self._energy)

    def _is_due(self, window: Window) -> bool:
        """Whether a map is to be written after a window."""
        every = self._maps.every
        if not isinstance(every, float):
            return every is not None and window.number % every == 0
        return int((window.time + 0.5 * window.dt) / every) > int((self._times[-1] + 0.5 * window.dt) / every)

    def _take(self, time: float) -> None:
        """A map at a ``time`` [s]."""
        self._due = True
        self._times.append(time)
        if self.rocks is not None:
            self.rocks.keep(time)

    # ---------------------------------------------------------------- for the record

    def columns(self) -> Dict[str, tuple]:
        """Of the history."""
        return self.places.columns()

    def due(self) -> Dict[str, Callable[[Path], None]]:
        """Files to be written now: name → function that does so, on rank 0."""
        due, self._due = self._due, False
        goes_on, self._goes_on = self._goes_on, False
        until_now = self._until_now() if due or goes_on else {}  # a run that dies leaves them as they are
        return {**until_now, **self._map_of_now()} if due else until_now

    def _map_of_now(self) -> Dict[str, Callable[[Path], None]]:
        number, depth = len(self._times) - 1, self.flow.depth
        if self._dim == 3:
            values = np.where(depth > 0.0, depth, np.nan)
            return {f"depth_{number:04d}.asc": partial(self._grid, values=values)}
        now = {"depth": ("m", "of the flow"), "speed": ("m/s", "of the flow, mean over its depth")}
        table = partial(self._table, columns=now, values=[depth, self.flow.speed])
        return {f"profile_{number:04d}.csv": table}

    def pictures(self) -> Dict[str, Callable[[Path], None]]:
        """Files of the end."""
        files = {**self._until_now(), "map.png": self._draw}
        if self.rocks is not None:
            files["rocks.csv"] = self._rocks_csv
        return files

    def _until_now(self) -> Dict[str, Callable[[Path], None]]:
        """Files of all that has been until now, written anew with each map."""
        files: Dict[str, Callable[[Path], None]] = {}
        if self._dim == 3:
            files |= {f"{name}.asc": partial(self._largest_grid, name=name) for name in self._names}
            files["terrain.asc"] = lambda path: self._grid(path, self.ground)
        else:
            files["profile_max.csv"] = self._largest_table
        if self.rocks is not None:
            files |= {"rocks.csv": self.rocks.write_path, "rocks_largest.csv": self.rocks.write_largest}
        return files

    def entries(self, history: Any) -> Dict[str, Any]:
        """Of the report: times of the maps [s], depth from which a cell is reached [m], volumes [m^3]."""
        return {"maps": {"times": self._times, "dry": self.flow.dry, "volume_released": self.places.released,
                         **{name: value for name, value in self.places.now.items() if name[:7] == "volume_"}}}

    def get_state(self) -> Dict[str, Any]:
        """What is remembered, independent of the ranks."""
        return {"flow": self.flow.get_state(), "places": self.places.get_state(),
                "energy": self._energy.copy(), "times": tuple(self._times),
                "rocks": self.rocks and self.rocks.get_state()}

    def set_state(self, state: Dict[str, Any]) -> None:
        """The counterpart, when both sides have theirs."""
        self.flow.set_state(state["flow"])
        self.places.set_state(state["places"])
        self._energy[:], self._times, self._due = state["energy"], [float(t) for t in state["times"]], False
        if self.rocks is not None:
            self.rocks.set_state(state["rocks"])
        self._goes_on = True
        self._ground.go(self._solid.time)
        self.flow.look(self._bodies(), self._solid.time)  # a run may end here

    # ---------------------------------------------------------------- files, on rank 0

    @property
    def _names(self) -> List[str]:
        return [name for name in LARGEST if name != "rock_energy_max" or self.rocks is not None]

    @property
    def ground(self) -> np.ndarray:
        """Height of the terrain at the start in the middles of the cells [m], shape (rows, columns)."""
        if self._heights is None:
            still = Ground(self._maps.terrain)
            self._heights = still.height(self.raster.middles()).reshape(self.raster.shape)
        return self._heights

    def values(self, name: str) -> np.ndarray:
        """One of ``LARGEST`` [its unit], shape (rows, columns), NaN where there was nothing. On rank 0."""
        known = {"rock_energy_max": self._energy, "deposit": self.flow.depth}
        found = known.get(name)
        if found is None:
            found = self.flow.largest[name.removesuffix("_max")]
        return np.where(found > 0.0, found, np.nan) if name != "arrival" else found

    def _grid(self, path: Path, values: np.ndarray) -> None:
        write_grid(path, self.raster, values)

    def _largest_grid(self, path: Path, name: str) -> None:
        self._grid(path, self.values(name))

    def _table(self, path: Path, columns: Dict[str, Any], values: List[np.ndarray]) -> None:
        head = {"x": ("m", "middle of the cell"), "terrain": ("m", "its height there"), **columns}
        rows = self.raster.axis(0), self.ground[0], *(row for row, in values)
        write_table(path, head, np.column_stack(rows))

    def _largest_table(self, path: Path) -> None:
        columns = {name: LARGEST[name] for name in self._names}
        self._table(path, columns, [self.values(name) for name in columns])

    def _rocks_csv(self, path: Path) -> None:
        rocks = self.rocks
        assert rocks is not None
        if self._time > self._times[-1]:
            rocks.keep(self._time)
        rocks.write_path(path)

    def _draw(self, path: Path) -> None:
        paths = [] if self.rocks is None else [motion.x for _, motion in self.rocks.path]
        shown = Shown(self.values("depth_max"), self.values("deposit"), self._release, np.array(paths))
        chart = Chart(self.raster, self.ground, self._maps, self.flow.dry)
        chart.draw(path, shown, (self._solid, self._grains))
