"""Draws the picture of scenes.md: dry soil carries rocks down a slope onto a barrier; a minute.

    ./dev run python docs/draw_barrier.py                  docs/barrier.png
"""
import tempfile
from pathlib import Path

import numpy as np
from draw_rocks import surface

import coupling.pictures.figure as figure
from coupling import Output, Run, Scheme
from coupling.pictures.perspective import radius_of_points
from coupling.pictures.sights import sight
from coupling.pictures.space import gravity_of, paint, view_of
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Body, Box, Grid, Soil, Structure, of_points

H, WIDTH, SLOPE = 0.02, 0.12, np.radians(30.0)
TIMES = 0.04, 0.18, 0.32


def scene():
    """Solid and grains: a heap at the upper end of a chute, three rocks in front of it, a barrier below."""
    g = 9.81 * np.array([np.sin(SLOPE), -np.cos(SLOPE), 0.0])
    soil = Soil(1e5, 0.3, 1600.0, phi=32.0)
    heap = Body(Box((0.0, 0.0, 0.0), (0.16, 0.12, WIDTH)), (8, 6, 6), 2, soil.material(3), soil.rho,
                f_bar=True)
    room = Box((-0.04, -0.04, -0.04), (0.6, 0.24, WIDTH + 0.04))
    grid = Grid(room, tuple(int(round(length / H)) for length in np.subtract(room.upper, room.lower)))
    chute = Box((-0.005, -0.005, -0.005), (0.5, 0.15, WIDTH + 0.005))
    bed = Structure.plane("bed", (0.0, 0.0, 0.0), "+y", chute, friction=0.35)
    sides = [Structure.plane(name, (0.0, 0.0, at), normal, chute)
             for name, at, normal in (("near", WIDTH, "-z"), ("far", 0.0, "+z"))]
    back = Structure.plane("back", (0.0, 0.0, 0.0), "+x", chute)
    barrier = Structure.box("barrier", Box((0.38, 0.0, 0.0), (0.41, 0.09, WIDTH)), cells=(1, 4, 1),
                            friction=0.3)
    solid = MPM(grid, heap, [], of_points(heap), gravity=g, inertia="lumped",
                structures=[bed, *sides, back, barrier])
    stone = Material(1e7, 0.25)
    rock = Cluster.from_surface(*surface(12), rho=2600.0, size=0.05, spheres=20)
    rocks = [rock.scaled(factor, x=np.array(x)) for factor, x in (
        (1.0, (0.2, 0.021, 0.035)), (0.8, (0.2, 0.017, 0.09)), (0.6, (0.25, 0.013, 0.06)))]
    slide = {("spheres", one): Interaction(0.3, 0.3) for one in ("bed", "near", "far", "back", "barrier")}
    grains = Scene(None, Wall.discs(solid.interface.x, 0.3 * H), stone, Material(1e6, 0.3),
                   Interaction(0.3, 0.5), Interaction(0.3, 0.4), g, clusters=rocks,
                   structures=[bed, *sides, back, barrier],
                   materials={one: stone for _, one in slide}, interactions=slide)
    return solid, grains


class Looks:
    """Observer: what is to be seen at ``TIMES``."""

    def __init__(self, solid, grains):
        self.solid, self.grains, self.seen = solid, grains, []

    def __call__(self, window):
        """When the time has come."""
        if len(self.seen) < len(TIMES) and window.time > TIMES[len(self.seen)] - 0.5 * window.dt:
            x, _, data = self.solid.snapshot()["points"]
            speed = np.linalg.norm(data["velocity"], axis=1)
            self.seen.append((window.time, x.copy(), speed, sight(self.solid, self.grains, 3, window.time)))


def main():
    """Runs the scene and draws three moments side by side."""
    solid, grains = scene()
    looks = []

    def observe(solid, grains):
        looks.append(Looks(solid, grains))
        return looks

    scheme = Scheme(dt=1e-3, t_end=TIMES[-1], substeps=50)
    Run("barrier", solid, grains, scheme, Output(tempfile.mkdtemp()), observe=observe).go()
    draw(looks[0].seen, gravity_of(solid, None))


def draw(seen, gravity):
    """The picture of what has been seen."""
    plt = figure.pyplot()
    view = view_of([x for _, x, *_ in seen], [things for *_, things in seen], gravity)
    colours = figure.ramp("viridis", max(np.quantile(speed, 0.99) for _, _, speed, _ in seen))
    radius = radius_of_points(seen[0][1])
    panels, axes = plt.subplots(1, len(seen), figsize=(13.0, 3.4), layout="constrained")
    for axis, (time, x, speed, things) in zip(axes, seen):
        axis.imshow(paint(view, 560, (x, radius, colours.to_rgba(speed)[:, :3]), things))
        axis.set_title(f"t = {time:.2f} s", fontsize=10)
        axis.axis("off")
    panels.colorbar(colours, ax=axes, label="speed [m/s]", shrink=0.8)
    panels.savefig(Path(__file__).parent / "barrier.png", dpi=90)


if __name__ == "__main__":
    main()
