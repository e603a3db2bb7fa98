"""map.png: the largest depth of a flow over its terrain, with paths of rocks, structures and release area; in
the plane a profile."""
from pathlib import Path
from typing import Any, List, NamedTuple, Tuple

import numpy as np

from ..pictures.figure import pyplot
from ..shapes import placed, structures
from .maps import Maps
from .raster import Raster

DEPTHS = "viridis_r"
ON_GROUND = 1e-6  # of its height: what is no farther from the terrain is a part of it
GROUND = 0.5  # part of the map: a structure that covers more is the ground of the flow


class Shown(NamedTuple):
    """Largest depth, deposit, depth at the start [m], (rows, columns); paths of rocks [m], (times, n, D)."""

    largest: np.ndarray
    deposit: np.ndarray
    release: np.ndarray
    paths: np.ndarray


class Chart:
    """Of a ``raster`` over the ``ground``, heights [m], (rows, columns); dry: depth [m] that is not shown."""

    def __init__(self, raster: Raster, ground: np.ndarray, maps: Maps, dry: float) -> None:
        self._raster, self._ground, self._maps, self._dry = raster, ground, maps, dry

    def draw(self, path: Path, shown: Shown, sides: Tuple[Any, Any]) -> None:
        """Save the picture at ``path``; sides: solid and grains, whose structures are shown."""
        plt = pyplot()
        low, high = self._raster.lower, self._raster.upper
        if len(low) == 1:
            figure, axes = plt.subplots(figsize=(10, 4))
            self._profile(axes, shown, sides)
        else:
            wide, tall = high - low
            figure, axes = plt.subplots(figsize=(10, max(3.0, min(12.0, 8.5 * tall / wide + 0.8))))
            self._map(figure, axes, shown, sides)
        figure.savefig(path, dpi=150, bbox_inches="tight")
        plt.close(figure)

    # ---------------------------------------------------------------- in space

    def _map(self, figure: Any, axes: Any, shown: Shown, sides: Tuple[Any, Any]) -> None:
        low, high = self._raster.lower, self._raster.upper
        extent = (low[0], high[0], low[1], high[1])
        axes.imshow(self._hillshade(), cmap="gray", extent=extent, origin="lower", vmin=0.0, vmax=1.0)
        self._contours(figure, axes, shown)
        for line in np.moveaxis(shown.paths, 1, 0) if shown.paths.size else ():
            axes.plot(line[:, 0], line[:, 1], color="firebrick", linewidth=0.8)
            axes.plot(*line[-1, :2], "o", color="firebrick", markersize=3)
        for outline in self._outlines(sides):
            axes.fill(*outline.T, facecolor="0.35", edgecolor="black", linewidth=0.8)
        if self._maps.release is not None:
            release = np.asarray(self._maps.release, float)
            axes.plot(*np.concatenate([release, release[:1]]).T, color="black", linestyle="--", linewidth=1)
        self._mark_places(axes)
        axes.set(xlim=extent[:2], ylim=extent[2:], aspect="equal", xlabel="x [m]", ylabel="y [m]")
        axes.ticklabel_format(style="plain", useOffset=False)
        axes.locator_params(nbins=6)

    def _contours(self, figure: Any, axes: Any, shown: Shown) -> None:
        low, high = self._raster.lower, self._raster.upper
        x, y = (np.array([low[i], *self._raster.axis(i), high[i]]) for i in (0, 1))  # to the edge
        ground, *depths = (np.pad(values, 1, "edge") for values in (self._ground, shown.largest,
                                                                    shown.release))
        (depth, release), ground = map(np.nan_to_num, depths), np.ma.masked_invalid(ground)
        if np.ma.ptp(ground) > 0.0:
            lines = axes.contour(x, y, ground, 12, colors="0.25", linewidths=0.4, linestyles="-")
            axes.clabel(lines, fontsize=6, fmt="%g")
        if depth.max() > self._dry:
            levels = np.linspace(self._dry, depth.max(), 11)
            filled = axes.contourf(x, y, depth, levels, cmap=DEPTHS, alpha=0.8)
            figure.colorbar(filled, ax=axes, label="largest depth [m]", shrink=0.8, pad=0.02, format="%.2g")
        if self._maps.release is None and release.max() > self._dry:
            axes.contour(x, y, release, [self._dry], colors="black", linestyles="--", linewidths=1)

    def _hillshade(self) -> np.ndarray:
        """Brightness of the ground, lit from the north-west."""
        from matplotlib.colors import LightSource

        if min(self._raster.shape) == 1:
            return np.full(self._raster.shape, 0.8)
        there, size = ~np.isnan(self._ground), self._raster.cell
        ground = np.where(there, self._ground, np.nanmin(self._ground))
        shade = LightSource(azdeg=315, altdeg=45).hillshade(ground[::-1], dx=size, dy=size)[::-1]
        return np.where(there, 0.4 + 0.55 * shade, np.nan)

    def _outlines(self, sides: Tuple[Any, Any]) -> List[np.ndarray]:
        """Of the structures seen from above, but of the ground itself: corners [m], shape (k, 2)."""
        from scipy.spatial import ConvexHull, QhullError

        found, solid = [], sides[0]
        whole = np.prod(self._raster.upper - self._raster.lower)
        for one in structures(*sides):
            x = placed(one, solid.time)
            seen, over = x[:, :2], x[:, 2] - self._maps.terrain.height(x[:, :2])
            if np.nanmax(np.abs(over), initial=0.0) < ON_GROUND * np.ptp(x[:, 2]):
                continue  # a region of the terrain
            try:
                hull = ConvexHull(seen)
            except QhullError:  # a wall that is seen from its edge
                order = np.argsort(seen @ np.ptp(seen, axis=0))
                found.append(seen[order[[0, -1]]])
                continue
            if hull.volume < GROUND * whole:
                found.append(seen[hull.vertices])
        return found

    def _mark_places(self, axes: Any) -> None:
        plane = len(self._raster.lower) == 1
        for gauge in self._maps.gauges:
            at = (*gauge.at, self._at(gauge.at[0])) if plane else gauge.at
            axes.plot(*at, "^", color="black", markersize=4)
            axes.annotate(gauge.name, at, textcoords="offset points", xytext=(4, 3), fontsize=7)
        for line in self._maps.lines:
            if plane:
                axes.axvline(line.a[0], color="black", linewidth=0.8, linestyle=":")
                at = line.a[0], float(self._ground.max())
            else:
                axes.plot(*zip(line.a, line.b or line.a), color="black", linewidth=1.2)
                at = line.a  # type: ignore[assignment] # has two
            axes.annotate(line.name, at, textcoords="offset points", xytext=(3, 3), fontsize=7)

    # ---------------------------------------------------------------- in the plane

    def _at(self, x: float) -> float:
        return float(np.interp(x, self._raster.axis(0), self._ground[0]))

    def _profile(self, axes: Any, shown: Shown, sides: Tuple[Any, Any]) -> None:
        low, high = self._raster.lower[0], self._raster.upper[0]
        x = np.array([low, *self._raster.axis(0), high])  # to the edge
        ground, largest, end, start = (np.pad(np.nan_to_num(values[0]), 1, "edge") for values in (
            self._ground, shown.largest, shown.deposit, shown.release))
        axes.fill_between(x, ground, ground + largest, color="#b5cfe6", label="largest depth", linewidth=0)
        axes.fill_between(x, ground, ground + end, color="#c2a878", label="at the end", linewidth=0)
        axes.plot(x, np.where(start > 0.0, ground + start, np.nan), "--", color="black", linewidth=0.8,
                  label="at the start")
        axes.plot(x, ground, color="0.2", linewidth=1.2)
        seen = ground.min(), (ground + largest).max()
        for line in np.moveaxis(shown.paths, 1, 0) if shown.paths.size else ():
            axes.plot(*line.T, color="firebrick", linewidth=0.8)
            axes.plot(*line[-1], "o", color="firebrick", markersize=3)
        for one in structures(*sides):
            corners = placed(one, sides[0].time)[one.elements]
            axes.plot(*np.moveaxis(corners, 2, 0).transpose(0, 2, 1), color="0.35", linewidth=1.5)
        self._mark_places(axes)
        margin = 0.1 * (seen[1] - seen[0])
        axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(low, high), ylim=(seen[0] - margin, seen[1] + margin))
        axes.ticklabel_format(style="plain", useOffset=False)
        axes.legend(frameon=False, fontsize="small", ncol=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
