"""Draws the picture of scenes.md: the surface of a rock, its spheres, and a family of rocks in a box.

    ./dev run python docs/draw_rocks.py                    docs/rocks.png
"""
from pathlib import Path
from types import SimpleNamespace

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 - after the choice of the back end
import numpy as np  # noqa: E402

from coupling.pictures.perspective import Camera, Canvas  # noqa: E402
from dem_liggghts import Cluster  # noqa: E402

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


def main():
    """Three pictures side by side."""
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
    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.0), gridspec_kw={
        "width_ratios": [picture.shape[1] / picture.shape[0] for picture in pictures]})
    shares = f"{len(rock.radii)} spheres, {100 * rock.filling.covered:.0f} % of its volume"
    for axis, picture, title in zip(axes, pictures, ("the surface", shares, "sixty of them in a box")):
        axis.imshow(np.clip(picture, 0.0, 1.0))
        axis.set_title(title, fontsize=10)
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(Path(__file__).parent / "rocks.png", dpi=90)
    print(rock.filling)


if __name__ == "__main__":
    main()
