"""Pictures of scenes are made without a display, in the plane and in space."""
import numpy as np
import pytest

from coupling.pictures import animation, frames, picture
from coupling.pictures.clip import inside_box
from coupling.pictures.perspective import FINE, Camera, Canvas, edges_of, normals
from coupling.pictures.sights import magnified, outlines
from coupling.pictures.space import view_of

BLOCK = np.array([[k >> d & 1 for d in range(3)] for k in range(8)], float)
SIDES = (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)
FACES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])
THINGS = {2: {"spheres": (np.full((1, 2), 0.12), np.array([0.02])),
              "structures": (0.1 * np.array([[2, 0], [2, 1], [3, 1], [3, 0]]),
                             np.array([[0, 1], [1, 2], [2, 3], [3, 0]])),
              "walls": (np.array([[0.0, 0.0], [9.0, 0.0]]), np.array([[0, 1]]))},
          3: {"spheres": (np.full((1, 3), 0.12), np.array([0.02])), "rocks": (0.03 * BLOCK, FACES),
              "structures": (0.1 * BLOCK + [0.15, 0, 0], FACES),
              "walls": (9.0 * (BLOCK[[0, 4, 5, 1]] - 0.5) * [1, 0, 1], np.array([[0, 1, 2], [0, 2, 3]]))}}


def count_colours(image):
    """Of a picture with 256 levels each of red, green and blue, from 0 to 1."""
    return len(np.unique(np.rint(255.0 * image).astype(int) @ [1, 256, 256**2]))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_picture_is_made(tmp_path, dim):
    import matplotlib.image

    x = np.random.default_rng(0).uniform(0, 0.1, (50, dim))
    corners = 0.1 * np.array([[i >> d & 1 for d in range(dim)] for i in range(2**dim)], float)
    around = [[0, 1, 3, 2]] if dim == 2 else [[0, 1, 3, 2, 4, 5, 7, 6]]
    wall = corners[:dim], np.arange(dim)[None]
    picture.draw(tmp_path / "scene.png", x, (corners, np.array(around)), wall,
                 THINGS[dim], x[:, 0], ("t = 0 s", "height [m]"))
    image = matplotlib.image.imread(tmp_path / "scene.png")
    assert min(image.shape[:2]) > 300 and count_colours(image[..., :3]) > 50


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
    towards = camera.axes[2]
    near, far = (0.5 + side * 0.3 * towards for side in (1, -1))
    for order in (1, -1):
        canvas = Canvas(camera)
        for x, radius, colour in ((near[None], 0.2, RED), (far[None], 0.1, BLUE))[::order]:
            canvas.spheres(x, radius, colour)
        red, blue = reds_and_blues(canvas)
        assert red.any() and not blue.any()
    canvas, beside = Canvas(camera), 0.06 * camera.axes[0]
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
    assert count_colours(image) > 500  # shades
    assert 0.1 < (np.ptp(image, axis=2) > 0.1).mean() < 0.9 and 0.0 < edges_of(LOW, HIGH)[0].mean() < 1.0


# ---------------------------------------------------------------- scenes

def test_small_and_large_triangles_cover_what_they_should():
    """A block of 12 triangles, and the same of thousands: the same picture, but for the rims."""
    fine, elements = BLOCK, FACES
    for _ in range(4):  # each triangle into four
        a, b, c = (fine[column] for column in elements.T)
        count = len(elements)
        fine = np.concatenate([a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2])
        corner = np.arange(6 * count).reshape(6, count)
        elements = np.concatenate([corner[list(some)].T for some in
                                   ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))])
    images = []
    for x, triangles in ((BLOCK, FACES), (fine, elements)):
        canvas = Canvas(Camera(LOW - 0.2, HIGH + 0.2, 200))
        canvas.triangles(x, triangles, RED)
        images.append(canvas.picture())
    assert (np.abs(images[1] - images[0]).max(axis=2) > 0.05).mean() < 0.002
    assert 0.2 < (images[0][..., 0] > images[0][..., 2] + 0.2).mean() < 0.8


def test_cut_at_a_box_triangles_keep_their_side_and_area():
    """Of a plane through the middle of a cube along its diagonal: a hexagon with sides of half a diagonal."""
    across = np.array([1.0, -1.0, 0.0]), np.array([1.0, 1.0, -2.0])
    x = 0.5 + 20.0 * np.array([across[0] - across[1], -across[0] - across[1], across[1]])
    y, triangles = inside_box(x, np.array([[0, 1, 2]]), LOW, HIGH)
    found, before = normals(y, triangles), normals(x, np.array([[0, 1, 2]]))
    assert 0.5 * np.linalg.norm(found, axis=1).sum() == pytest.approx(1.5 * np.sqrt(3) * 0.5)
    assert (found @ before[0] >= 0.0).all()
    assert (y[triangles] > -1e-9).all() and (y[triangles] < 1 + 1e-9).all()
    assert len(inside_box(BLOCK + 2.0, FACES, LOW, HIGH)[1]) == 0
    assert np.array_equal(inside_box(BLOCK, FACES, LOW, HIGH)[1], FACES)


@pytest.mark.parametrize("gravity, flow", [((4.0, -8.0, 0.0), (1, 0, 0)), ((0.0, 3.0, -9.0), (0, 1, 0)),
                                           ((-3.0, 0.0, -9.0), (-1, 0, 0)), ((0.0, -9.8, 0.0), (0, 0, -1))],
                         ids=["along x, y up", "along y, z up", "against x, z up", "as the points go"])
def test_the_eye_looks_along_the_flow_from_above(gravity, flow):
    """So that what flows goes away from it and to the right, and all is in the picture."""
    x = np.random.default_rng(0).uniform(0, 1, (100, 3))
    frames, things = [x, x + 0.3 * np.array(flow)], [{"rocks": (BLOCK + 1.5, FACES)}] * 2
    view = view_of(frames, things, np.array(gravity))
    camera, middle = view.camera(300), [[0.5, 0.5, 0.5], 0.5 + 0.4 * np.array(flow)]
    place, depth, _ = camera(np.concatenate([middle, *frames, BLOCK + 1.5]))
    assert depth[1] > depth[0] and place[1, 0] > place[0, 0]
    assert (place >= 0).all() and (place <= [camera.width, camera.height]).all()
    above = camera.eye @ -np.array(gravity) if any(gravity) else camera.eye[1]
    assert above > x.max(axis=0) @ np.abs(gravity) * 0.5


def test_an_animation_shows_all_that_is_there(tmp_path):
    from PIL import Image

    for dim in (2, 3):
        x = np.random.default_rng(0).uniform(0, 0.1, (200, dim))
        some = [(f"t = {k} s", x + 0.01 * k, x[:, 0], THINGS[dim]) for k in range(3)]
        animation.save(tmp_path / "flow.gif", some, "speed [m/s]")
        with Image.open(tmp_path / "flow.gif") as shown:
            assert shown.n_frames == 3 and shown.size[0] == animation.WIDTH
            image = np.asarray(shown.convert("RGB"), float) / 255.0
        grey = (np.abs(image - [0.62, 0.66, 0.74]).max(axis=2) < 0.12)
        assert 0.01 < grey.mean() < 0.6


def test_places_between_start_and_end():
    first, last = {"rocks": (BLOCK, FACES)}, {"rocks": (BLOCK + 1.0, FACES), "walls": (BLOCK, FACES)}
    moved = magnified(first, last, 10.0)
    assert moved["rocks"][0] == pytest.approx(BLOCK + 10.0) and moved["walls"][0] is BLOCK
    closed, = outlines(*THINGS[2]["structures"])
    assert len(closed) == 5 and np.array_equal(closed[0], closed[-1])
