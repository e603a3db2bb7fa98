"""A sphere at rest on a soft bed, its contact damped, weakly coupled: nothing is thrown off without a
word."""
import warnings

import numpy as np
import pytest

from coupling.ledger.exchange import UnstableError
from coupling.records.history import read
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall, longest_window

BED = dict(scene="rest", length=0.04, height=0.02, E=1e6, gravity=9.81, inertia="lumped", windows=120)
NODE = 0.5 * 7960 * 5e-3**2 * 0.01  # mass of a node of the bed's upper side [kg]


@pytest.fixture
def lie(extreme, tmp_path):
    """``lie(part, restitution, key=value, …)``: the sphere laid on the bed, in windows of that part of the
    limit under its weight, until it has gained too much energy; returns how much the force differs from the
    mean of those before and after, at most, in weights, and the warnings."""
    def run(part, restitution, **keys):
        wall, soft = Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]]), Material(BED["E"], 0.289)
        ball = Scene(Spheres([[0.0, 0.01]], [[0.0, 0.0]], 0.01, 7960.0), wall, soft, soft,
                     at_wall=Interaction(restitution))
        weight = ball.spheres.mass[0] * BED["gravity"]
        dt = part * longest_window(ball, NODE, weight)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                extreme.main(**BED, restitution=restitution, dt=dt, out=str(tmp_path), **keys)
            except UnstableError as stopped:
                assert "iterate=20" in str(stopped)
        force = read(tmp_path / "history.csv")["force"]
        return 0.5 * np.abs(np.diff(force, 2)).max() / weight, [str(warning.message) for warning in said]

    return run


@pytest.mark.parametrize("restitution", [0.05, 0.3])
def test_said_beyond_the_limit_and_not_below(lie, restitution, backend):
    rings, said = lie(0.6, restitution, dem=backend)
    assert rings < 0.5 and not said
    rings, said = lie(2.5, restitution, dem=backend)
    assert rings > 1.5 and "that weak coupling bears" in said[0] and "pushes 0.001" in said[0]
    assert "weak coupling has made" in said[1] and len(said) == 2
    rings, said = lie(2.5, restitution, dem=backend, iterate=20, at=(1e-3,))  # beside a vertex
    assert rings < 0.01 and not said
