"""Pictures of scenes are made without a display, in the plane and in space."""
import numpy as np
import pytest

from coupling.pictures import frames, picture
from coupling.pictures.perspective import FINE, Camera, Canvas, edges_of


@pytest.mark.parametrize("dim", [2, 3])
def test_a_picture_is_made(tmp_path, dim):
    import matplotlib.image

    x = np.random.default_rng(0).uniform(0, 0.1, (50, dim))
    corners = 0.1 * np.array([[i >> d & 1 for d in range(dim)] for i in range(2**dim)], float)
    around = [[0, 1, 3, 2]] if dim == 2 else [[0, 1, 3, 2, 4, 5, 7, 6]]
    wall = corners[:dim], np.arange(dim)[None]
    picture.draw(tmp_path / "scene.png", x, (corners, np.array(around)), wall,
                 (np.full((1, dim), 0.12), np.array([0.02])), x[:, 0], "height [m]")
    image = matplotlib.image.imread(tmp_path / "scene.png")
    assert min(image.shape[:2]) > 300 and len(np.unique(image[..., :3].reshape(-1, 3), axis=0)) > 50


# ---------------------------------------------------------------- in perspective

LOW, HIGH, RED, BLUE = np.zeros(3), np.ones(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def reds_and_blues(canvas):
    """Masks of the pixels that are more red than blue, and the other way round."""
    image = canvas.picture()
    return image[..., 0] > image[..., 2] + 0.2, image[..., 2] > image[..., 0] + 0.2


@pytest.mark.parametrize("radius", [0.01, 0.2])
def test_a_sphere_is_a_disc_of_its_size_in_its_place(radius):
    """Small spheres are drawn together, large ones one by one."""
    camera, at = Camera(LOW, HIGH, 400), np.array([[0.5, 0.5, 0.5]])
    canvas = Canvas(camera)
    canvas.spheres(at, np.array([radius]), RED)
    red, _ = reds_and_blues(canvas)
    rows, columns = np.nonzero(red)
    (place,), _, (size,) = camera(at)
    assert np.abs([columns.mean() + 0.5, rows.mean() + 0.5] - place / FINE).max() < 1.0
    assert red.sum() == pytest.approx(np.pi * (radius * size / FINE) ** 2, rel=0.06 if radius > 0.1 else 0.4)


def test_what_is_in_front_hides_what_is_behind():
    """In either order, between kinds, and pixel by pixel where two spheres cut each other."""
    camera = Camera(LOW, HIGH, 300)
    towards = camera._axes[2]
    near, far = (0.5 + side * 0.3 * towards for side in (1, -1))
    for order in (1, -1):
        canvas = Canvas(camera)
        for x, radius, colour in ((near[None], 0.2, RED), (far[None], 0.1, BLUE))[::order]:
            canvas.spheres(x, radius, colour)
        red, blue = reds_and_blues(canvas)
        assert red.any() and not blue.any()
    canvas, beside = Canvas(camera), 0.06 * camera._axes[0]
    canvas.spheres(0.5 + np.array([-beside, beside]), 0.1, np.array([RED, BLUE]))
    red, blue = (np.nonzero(mask)[1].mean() for mask in reds_and_blues(canvas))
    assert red < blue
    canvas = Canvas(camera)
    wall = np.array([[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]])
    canvas.triangles(wall, np.array([[0, 1, 2], [0, 2, 3]]), BLUE)
    canvas.spheres(np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]]), 0.1, np.array([[0.0, 1.0, 0.0], RED]))
    image = canvas.picture()
    # one is behind the wall
    assert reds_and_blues(canvas)[0].any() != (image[..., 1] > image[..., 2] + 0.2).any()


def test_frames_in_space_show_points_and_walls(tmp_path):
    import matplotlib.image

    x = np.random.default_rng(0).uniform(0, 0.1, (300, 3))
    frames.draw(tmp_path / "flow.png", [(f"t = {k} s", x, x[:, 0]) for k in range(3)], "speed [m/s]",
                walls=("-y", "-x"))
    image = matplotlib.image.imread(tmp_path / "flow.png")[..., :3]
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 500  # shades
    assert 0.1 < (np.ptp(image, axis=2) > 0.1).mean() < 0.9 and 0.0 < edges_of(LOW, HIGH)[0].mean() < 1.0
