"""Draws the picture of scenes.md: the surface of a rock, its spheres, a family in a box, and at rest.

    ./dev run python docs/draw_rocks.py                    docs/rocks.png
"""
from pathlib import Path
from types import SimpleNamespace

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 - after the choice of the back end
import numpy as np  # noqa: E402

from coupling.pictures.perspective import Camera, Canvas, edges_of  # noqa: E402
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall, quaternion  # noqa: E402

STONE, SPHERE = np.array([0.72, 0.62, 0.5]), np.array([0.45, 0.6, 0.75])


def surface(n=64):
    """Vertices and triangles of a ball with bumps and hollows, longer than wide."""
    up, around = np.meshgrid(np.linspace(0.0, np.pi, n + 1), np.linspace(0.0, 2.0 * np.pi, 2 * n + 1))
    x = np.column_stack([np.sin(up.ravel()) * np.cos(around.ravel()), np.cos(up.ravel()),
                         np.sin(up.ravel()) * np.sin(around.ravel())])
    random = np.random.default_rng(1)
    waves, phases = 1.5 * random.normal(size=(12, 3)), random.uniform(0.0, 6.28, 12)
    x *= (1.0 + 0.7 * np.sin(x @ waves.T + phases).mean(axis=1))[:, None] * [1.3, 0.8, 1.0]
    a = (np.arange(2 * n)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    return x, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def at_rest(rocks, size=6.0, height=12.0):
    """The rocks where they come to lie in a box that is open above."""
    x = np.array([(i, j, k) for j in (0.0, height) for k in (0.0, size) for i in (0.0, size)])
    sides = [(0, 2, 1), (1, 2, 3), (0, 1, 4), (1, 5, 4), (1, 3, 5), (3, 7, 5), (3, 2, 7), (2, 6, 7),
             (2, 0, 6), (0, 4, 6)]
    stone, meet = Material(1e9, 0.25), Interaction(0.3, 0.5)
    return Scene(None, Wall(x, sides), stone, stone, meet, meet, (0.0, -9.81, 0.0), rocks).settled().clusters


def draw_heap(rocks):
    """Their surfaces in the lower part of the box."""
    low, high = np.zeros(3), np.array([6.0, 3.6, 6.0])
    canvas = Canvas(Camera(low, high, width=420, elevation=28.0))
    canvas.lines(*edges_of(low, high), np.full(3, 0.6))
    for rock in rocks:
        x, triangles = rock.surface
        x = rock.x + (x - rock.centre) @ quaternion.matrix(rock.quaternion).T
        canvas.triangles(x, triangles, STONE)
    return canvas.picture()


def main():
    """Four pictures side by side."""
    x, triangles = surface()
    rock = Cluster.from_surface(x, triangles, rho=2600.0)
    box = SimpleNamespace(lower=(0.0, 0.0, 0.0), upper=(6.0, 6.0, 6.0))
    rocks = Cluster.packed([rock.scaled(s) for s in np.linspace(0.25, 0.8, 60)], inside=box, seed=1)
    pictures = []
    for number in range(3):
        low, high = (np.zeros(3), np.full(3, 6.0)) if number == 2 else (x.min(axis=0), x.max(axis=0))
        canvas = Canvas(Camera(low, high, width=420))
        if number == 0:
            canvas.triangles(x, triangles, STONE)
        for body in {0: (), 1: (rock,), 2: rocks}[number]:
            canvas.spheres(body.places, body.radii, SPHERE if number == 1 else STONE)
        pictures.append(canvas.picture())
    pictures.append(draw_heap(at_rest(rocks)))
    figure, axes = plt.subplots(1, 4, figsize=(13.0, 2.8), gridspec_kw={
        "width_ratios": [picture.shape[1] / picture.shape[0] for picture in pictures]})
    shares = f"{len(rock.radii)} spheres, {100 * rock.filling.covered:.0f} % of its volume"
    titles = "the surface", shares, "sixty of them in a box", "at rest, settled"
    for axis, picture, title in zip(axes, pictures, titles):
        axis.imshow(np.clip(picture, 0.0, 1.0))
        axis.set_title(title, fontsize=10)
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(Path(__file__).parent / "rocks.png", dpi=90)
    print(rock.filling)


if __name__ == "__main__":
    main()
