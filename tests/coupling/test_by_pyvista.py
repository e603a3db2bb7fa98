"""Pictures in space by PyVista where it draws, else without it; structures that hide the soil."""
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coupling.pictures import animation, by_pyvista, canvases, perspective, space
from coupling.pictures.perspective import FINE, radius_of_points

BLOCK = np.array([[k >> d & 1 for d in range(3)] for k in range(8)], float)
SIDES = (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)
FACES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])
GREEN = np.array([0.0, 1.0, 0.0])
ALONG = np.linspace(0.02, 0.98, 16)
SOIL = np.stack(np.meshgrid(ALONG, 0.5 * ALONG[::2], 0.5 * ALONG[::2]), axis=-1).reshape(-1, 3)
# before the soil as the eye sees it, behind it, and below it
NEAR, BEHIND, FLOOR = (BLOCK * [1.0, 0.6, 0.05] + [0.0, 0.0, 0.55], BLOCK * [0.1, 0.6, 0.5] + [1.2, 0.0, 0.0],
                       BLOCK * [2.0, 0.02, 0.7] - [0.1, 0.03, 0.05])
DOWNHILL = np.array([4.0, -8.0, 0.0])


def scene(*structures):
    """Sight of a rock on the soil, a sphere beside it and structures."""
    elements = np.concatenate([FACES + 8 * k for k in range(len(structures))])
    return {"rocks": (0.2 * BLOCK + [0.2, 0.5, 0.1], FACES),
            "spheres": (np.array([[0.7, 0.6, 0.2]]), np.array([0.1])),
            "structures": (np.concatenate(structures), elements)}


def painted(canvas, things, width=300):
    view = space.view_of([SOIL], [things], DOWNHILL)
    drawn = canvas(view.camera(width))
    space.draw_on(drawn, view, (SOIL, radius_of_points(SOIL), GREEN), things)
    return drawn.by_pyvista() if canvas is by_pyvista.Canvas else drawn.picture()


def parts(image):
    """Masks of the pixels of soil, rocks and structures, by their colours."""
    red, green, blue = np.moveaxis(image, 2, 0)
    soil = green > red + 0.15
    coloured = np.ptp(image, axis=2) > 0.02
    return {"soil": soil, "rocks": ~soil & coloured & (red > blue),
            "structures": ~soil & coloured & (blue > red)}


@pytest.fixture
def drawing():
    """PyVista is there and draws."""
    pytest.importorskip("pyvista")
    if not canvases.pyvista_draws():
        pytest.skip("PyVista is installed, but cannot draw here")


def test_a_picture_by_pyvista_shows_what_one_without_it_shows(drawing):
    """Soil, rocks and walls on the same pixels, but for their rims."""
    ours, theirs = (parts(painted(canvas, scene(BEHIND, FLOOR)))
                    for canvas in (perspective.Canvas, by_pyvista.Canvas))
    for name, least in (("soil", 0.1), ("rocks", 0.01), ("structures", 0.1)):
        assert theirs[name].mean() > least, name
        differing = (ours[name] != theirs[name]).sum()
        assert differing < 0.05 * ours[name].sum() + 100, name


def test_spheres_by_pyvista_have_their_size_and_hide_each_other_pixel_by_pixel(drawing):
    camera = perspective.Camera(np.zeros(3), np.ones(3), 400)
    at, beside = np.full((1, 3), 0.5), 0.06 * camera.axes[0]
    canvas = by_pyvista.Canvas(camera)
    canvas.spheres(at, np.array([0.2]), GREEN)
    green = canvas.by_pyvista()[..., 1] > canvas.by_pyvista()[..., 2] + 0.2
    (place,), _, (size,) = camera(at)
    rows, columns = np.nonzero(green)
    assert green.sum() == pytest.approx(np.pi * (0.2 * size / FINE)**2, rel=0.06)
    assert np.abs([columns.mean() + 0.5, rows.mean() + 0.5] - place / FINE).max() < 1.0
    canvas = by_pyvista.Canvas(camera)
    canvas.spheres(at + [-beside, beside], 0.1, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    image = canvas.by_pyvista()
    left, right = image[..., 0] > image[..., 2] + 0.2, image[..., 2] > image[..., 0] + 0.2
    assert np.nonzero(left)[1].max() <= np.nonzero(right)[1].min() + 1  # the cut is straight


def test_an_animation_by_pyvista_moves(drawing, tmp_path):
    from PIL import Image

    frames = [(f"t = {k} s", SOIL + [0.2 * k, 0.0, 0.0], SOIL[:, 1], scene(FLOOR)) for k in range(3)]
    animation.save(tmp_path / "flow.gif", frames, "speed [m/s]", (DOWNHILL, None))
    with Image.open(tmp_path / "flow.gif") as shown:
        assert shown.n_frames == 3 and shown.size[0] == animation.WIDTH
        images = [np.asarray((shown.seek(k), shown.convert("RGB"))[1], float) for k in range(3)]
    assert np.abs(images[2] - images[0]).max(axis=2).astype(bool).mean() > 0.1


@pytest.mark.parametrize("module", [perspective, by_pyvista], ids=["perspective", "by_pyvista"])
def test_structures_that_hide_the_soil_are_seen_through(module, request):
    """And only those."""
    if module is by_pyvista:
        request.getfixturevalue("drawing")
    things = scene(NEAR, BEHIND, FLOOR)
    clear = space.view_of([SOIL], [things], DOWNHILL).clear
    assert clear.reshape(3, 12).all(axis=1).tolist() == [True, False, False] and clear.sum() == 12
    through, free = (painted(module.Canvas, some) for some in (things, scene(BEHIND, FLOOR)))
    assert parts(through)["soil"].sum() > 0.7 * parts(free)["soil"].sum()
    assert not np.array_equal(through, free)


BROKEN = {"crash": ("import os; os.abort()", "signal 6"),
          "hang": ("import time; time.sleep(60)", "no answer"),
          "error": ("raise ImportError('no libGL')", "no libGL")}


@pytest.mark.parametrize("broken, said", BROKEN.values(), ids=BROKEN)
def test_where_pyvista_cannot_draw_one_line_says_so_and_the_picture_is_drawn(tmp_path, broken, said):
    """A PyVista that ends the process, that fails, that never answers."""
    (tmp_path / "pyvista.py").write_text(broken)
    code = """import numpy as np
from coupling.pictures import canvases, perspective
canvases.PATIENCE = 3.0
for _ in range(2):
    canvas = canvases.new_canvas(perspective.Camera(np.zeros(3), np.ones(3), 50))
    canvas.spheres(np.full((1, 3), 0.5), 0.2, np.zeros(3))
    print(canvas.picture().min() < 0.5)"""
    root, paths = Path(__file__).parents[2], os.environ.get("PYTHONPATH", "")
    clean = {name: value for name, value in os.environ.items() if name != canvases.WINDOW}
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, timeout=100,
                          env={**clean, "PYTHONPATH": f"{tmp_path}{os.pathsep}{paths}"})
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "True"]
    assert done.stderr.count("cannot draw here") == 1 and said in done.stderr


def test_a_picture_that_pyvista_does_not_finish_is_drawn_without_it(monkeypatch):
    """A driver may fail later than in the trial."""
    def out_of_memory(*size):
        raise MemoryError("no buffer of this size")

    monkeypatch.setattr(by_pyvista, "_plotter", out_of_memory)
    camera = perspective.Camera(np.zeros(3), np.ones(3), 60)
    pictures = []
    for canvas in (by_pyvista.Canvas(camera), perspective.Canvas(camera)):
        canvas.spheres(np.full((1, 3), 0.5), 0.2, GREEN)
        canvas.triangles(BLOCK, FACES, np.ones(3), 0.3)
        canvas.lines(BLOCK[:1], BLOCK[7:], np.zeros(3))
        if pictures == []:
            with pytest.warns(UserWarning, match="no buffer of this size"):
                pictures.append(canvas.picture())
        else:
            pictures.append(canvas.picture())
    assert np.array_equal(*pictures) and pictures[0].min() < 0.5
