"""Fixtures shared by all tests. What MPMDEM_REQUIRE names (comma-separated, as "liggghts") must not be
skipped."""
import gc
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dem_liggghts import open_dem
from mpm_dem_mpi import outside_mpi
from tests import standing_ranks
from tests.standing_ranks import StandingRanks

OPEN_MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",  # as ./dev sets them
            "OMPI_MCA_rmaps_base_oversubscribe": "1",  # Open MPI 4
            "OMPI_MCA_pml": "ob1",  # one computer needs no look for fast networks, which takes 0.2 s
            # Open MPI 5; other MPIs know none of these
            "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe"}
# A shell lets what it starts in the background ignore interrupts, and so would all runs that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish():
    """Thousands of tests, and the libraries, stay to the end: without this, looking through them for what
    does not takes a twentieth of the time of all tests."""
    gc.collect()
    gc.freeze()


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


@pytest.fixture
def liggghts():
    """For tests that need LIGGGHTS and nothing else of it."""
    need_liggghts()


def need_liggghts():
    """Skip the test when LIGGGHTS is missing, or fail when it is required."""
    try:
        from dem_liggghts.liggghts.library import SHIM, load
        load(SHIM)
    except ImportError as missing:
        if "liggghts" in os.environ.get("MPMDEM_REQUIRE", ""):
            pytest.fail(f"LIGGGHTS is required: {missing}")
        pytest.skip(str(missing))


@pytest.fixture
def start_process():
    """``start_process(command, env, …)``: a process with its output in pipes; killed at the end."""
    started = []

    def start(command, env, **keys):
        streams = dict(stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(subprocess.Popen(command, env=env, **{**streams, **keys}))
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
            process.communicate()


@pytest.fixture
def start_ranks(start_process):
    """``start_ranks(n, *words)``: a Python process with these words on each of n ranks, as a ``Popen``.
    Without mpirun the test is skipped, or fails when mpi is required."""
    need_mpirun()
    return lambda n, *words: start_process(*command_on(n, *words))


def need_mpirun():
    """Skip the test when mpirun is missing, or fail when mpi is required."""
    if shutil.which("mpirun") is None:
        (pytest.fail if "mpi" in os.environ.get("MPMDEM_REQUIRE", "") else pytest.skip)("mpirun is missing")


def command_on(n, *words):
    """Command of a Python process with these words on each of n ranks, and its environment."""
    env = outside_mpi()  # this process may be a rank, or the one that started it to run tests side by side
    env.update(PYTHONPATH=str(Path(__file__).parents[1]), OMP_NUM_THREADS="1", **OPEN_MPI)
    # Not tied to cores: else ranks of tests side by side crowd on the first ones. Who waits lets others have
    # its core: without that, two ranks on a busy machine spent ten times the processor time on an exchange.
    env.update(OMPI_MCA_hwloc_base_binding_policy="none", OMPI_MCA_mpi_yield_when_idle="1")
    return ["mpirun", "-n", str(n), sys.executable, *map(str, words)], env


@pytest.fixture
def run_ranks(start_ranks):
    """``run_ranks(n, *words)`` waits for the end; status, stdout and stderr as in
    ``subprocess.CompletedProcess``."""
    def run(n, *words, timeout=240):
        process = start_ranks(n, *words)
        out, err = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(words, process.returncode, out, err)

    return run


@pytest.fixture(scope="session")
def standing(tmp_path_factory):
    """``StandingRanks`` by their number, closed at the end."""
    found = {}
    yield found
    for ranks in found.values():
        ranks.close()


@pytest.fixture
def on_ranks(standing, tmp_path_factory, request):
    """``on_ranks(n, code, *words)``: as ``run_ranks(n, "-c", code, *words)``, on ranks that stay, see
    ``standing_ranks``. The code imports test files of its folder."""
    need_mpirun()

    def run(n, code, *words, timeout=240):
        if n not in standing or not standing[n].stand:
            folder = tmp_path_factory.mktemp(f"ranks{n}")
            standing[n] = StandingRanks(n, folder, *command_on(n, standing_ranks.__file__, folder))
        places = request.path.parent, request.config.rootpath
        return standing[n].run(code, *words, places=places, timeout=timeout)

    return run


AS_SCRIPT = """
import os, runpy, sys, warnings
del sys.argv[0]
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
with warnings.catch_warnings():  # a case shows them in its own way
    runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.fixture
def script_on_ranks(on_ranks):
    """``script_on_ranks(n, script, *words)``: as ``run_ranks``, on ranks that stay; for what does not ask how
    a program begins and ends."""
    return lambda n, *words, **keys: on_ranks(n, AS_SCRIPT, *words, **keys)


@pytest.fixture
def disk(tmp_path):
    """``disk("256k")``: a folder that is a disk of that size. Where the user may not mount one, the test is
    skipped."""
    mounted = []

    def mount(size):
        place = tmp_path / f"disk{len(mounted)}"
        place.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", place]
        if subprocess.run(command, capture_output=True).returncode:
            pytest.skip("this user may not mount")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", place], check=True)
