"""Fixtures shared by all tests. What MPMDEM_REQUIRE names (comma-separated, as "liggghts") must not be skipped."""
import os

import pytest

from dem_liggghts import open_dem


@pytest.fixture(params=["reference", "liggghts"])
def dem(request):
    """``dem(scene, dt)`` opens a back end; each test runs on both, the instances are closed at its end."""
    if request.param == "liggghts":
        need_liggghts()
    instances = []

    def start(scene, dt):
        instances.append(open_dem(request.param, scene, dt))
        return instances[-1]

    start.backend = request.param
    yield start
    for instance in instances:
        instance.close()


@pytest.fixture(params=["reference", "liggghts"])
def backend(request):
    """Name of a back end, for tests that open it elsewhere."""
    if request.param == "liggghts":
        need_liggghts()
    return request.param


@pytest.fixture
def both():
    """``both(scene, dt)`` opens the two back ends on one scene."""
    need_liggghts()
    return lambda scene, dt: (open_dem("reference", scene, dt), open_dem("liggghts", scene, dt))


def need_liggghts():
    """Skip the test when LIGGGHTS is missing, or fail when it is required."""
    try:
        from dem_liggghts.liggghts import SHIM, load
        load(SHIM)
    except ImportError as missing:
        if "liggghts" in os.environ.get("MPMDEM_REQUIRE", ""):
            pytest.fail(f"LIGGGHTS is required: {missing}")
        pytest.skip(str(missing))
