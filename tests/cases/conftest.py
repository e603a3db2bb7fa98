"""The case scripts as modules, and a beam that takes a tenth of a second."""
import importlib.util
import sys
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

CASES = Path(__file__).parents[2] / "cases"
sys.path.insert(0, str(CASES))  # as for a script: cases may import their neighbours
COARSE = dict(cells=(31, 7), body=(60, 4), points=3, segments=30, dt=4e-6, substeps=80, t_end=2e-4)


def coarse(with_h):
    """Keys of the coarse beam; ``cells`` would win over a cell size h."""
    return {key: value for key, value in COARSE.items() if not (with_h and key == "cells")}


def load(name):
    spec = importlib.util.spec_from_file_location(name, CASES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def no_words(monkeypatch):
    """PETSc's options are those of the case, not those of pytest."""
    monkeypatch.setattr("sys.argv", ["case.py"])


@pytest.fixture(scope="session")
def sphere_drop():
    """The module ``cases/sphere_drop.py``."""
    return load("sphere_drop")


@pytest.fixture(scope="session")
def case():
    """The module ``cases/beam_impact.py``."""
    return load("beam_impact")


@pytest.fixture(scope="session")
def multiple():
    """The module ``cases/multiple_impact.py``."""
    return load("multiple_impact")


@pytest.fixture(scope="session")
def column():
    """The module ``cases/column_collapse.py``."""
    return load("column_collapse")


@pytest.fixture(scope="session")
def blocks():
    """The module ``cases/granular_blocks.py``."""
    return load("granular_blocks")


@pytest.fixture(scope="session")
def extreme():
    """The module ``cases/extreme.py``."""
    return load("extreme")


@pytest.fixture
def run(case, tmp_path):
    """``run(key=value, …)`` runs the coarse beam, results in ``tmp_path``; returns its histories."""
    return lambda **keys: case.main(**{**coarse("h" in keys), "out": str(tmp_path), **keys})


@pytest.fixture
def coarse_keys():
    """Keys of the coarse beam."""
    return dict(COARSE)


@pytest.fixture
def words(tmp_path):
    """``words("key=value …")``: the coarse beam as words of a command line, but for the keys that are given;
    of a key given twice the last value counts."""
    def begin(more=""):
        given = {word.partition("=")[0] for word in more.split()}
        keys = {**coarse("h" in given), "out": tmp_path}
        plain = [f"{key}={','.join(map(str, value)) if isinstance(value, tuple) else value}"
                 for key, value in keys.items() if key not in given]
        last = {word.partition("=")[0]: word for word in more.split() if "=" in word}
        return [*plain, *last.values(), *(word for word in more.split() if "=" not in word)]

    return begin


@pytest.fixture
def pieces():
    """``pieces(folder, name)`` of a ParaView series: a list of times, each (time [s], {part: mesh})."""
    def collect(folder, name):
        times = {}
        for entry in ElementTree.parse(folder / f"{name}.pvd").findall("Collection/DataSet"):
            part = entry.get("part")
            times.setdefault(float(entry.get("timestep")), {})[part and int(part)] = meshio.read(folder /
            entry.get("file"))
        return list(times.items())

    return collect


@pytest.fixture
def joined():
    """``joined(meshes)``: positions, fields, and the corners of the cells of all pieces, each in an order of
    its own: points by number, else by place. Nodes that several pieces have are there as often."""
    def join(meshes):
        x = np.concatenate([mesh.points for mesh in meshes])
        data = {name: np.concatenate([mesh.point_data[name] for mesh in meshes])
                for name in meshes[0].point_data}
        corners = np.concatenate([mesh.points[mesh.cells[0].data] for mesh in meshes])
        order = np.argsort(data["gid"]) if "gid" in data else np.lexsort(np.round(x, 9).T)
        by_place = np.lexsort(np.round(corners.mean(axis=1), 9).T)
        return x[order], {name: values[order] for name, values in data.items()}, corners[by_place]

    return join


@pytest.fixture
def boulder_barrier():
    """The module ``cases/boulder_barrier.py``."""
    return load("boulder_barrier")


@pytest.fixture
def sand_on_wall():
    """The module ``cases/sand_on_wall.py``."""
    return load("sand_on_wall")


@pytest.fixture(scope="session")
def terrain():
    """The module ``cases/terrain.py``."""
    return load("terrain")


@pytest.fixture(scope="session")
def flume():
    """The module ``cases/flume.py``."""
    return load("flume")


@pytest.fixture(scope="session")
def dam_break():
    """The module ``cases/dam_break.py``."""
    return load("dam_break")
