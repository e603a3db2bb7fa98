"""Pictures of scenes are made without a display, in the plane and in space."""
import numpy as np
import pytest

from coupling import picture


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
