"""States on disk: read is what was written, on any number of ranks; damage and full disks are noticed."""
import math
import struct

import numpy as np
import pytest
from mpi4py import MPI

import mpm_dem_store as store
from mpm_dem_store import Table

ONE = MPI.COMM_SELF
POINT = np.dtype([("F", "f8", (3, 3)), ("plastic", "?"), ("age", "i4")])


def there_and_back(tmp_path, tree):
    size = store.write(tmp_path / "state.h5", tree, {}, ONE)
    assert [entry.name for entry in tmp_path.iterdir()] == ["state.h5"]
    assert size == (tmp_path / "state.h5").stat().st_size
    return store.read(tmp_path / "state.h5", ONE)


def same(one, two):
    """Equal to the last bit, and of the same types."""
    if type(one) is not type(two):
        return False
    if isinstance(one, dict):
        return list(one) == list(two) and all(same(one[key], two[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(two) and all(map(same, one, two))
    if isinstance(one, (np.ndarray, np.generic)):
        return one.dtype == two.dtype and one.shape == two.shape and one.tobytes() == two.tobytes()
    if isinstance(one, float):
        return struct.pack("d", one) == struct.pack("d", two)
    return one == two


ODD_NAN = struct.unpack("<d", b"\1\2\3\4\5\6\xf8\xff")[0]
VALUES = {
    "none": None, "truths": [True, False], "whole": [0, -1, 10**40],
    "texts": ["", "ü → 𝄞", "a\0b", "\ud800"],
    "floats": [0.1, -0.0, 5e-324, math.inf, -math.inf, math.nan, ODD_NAN],
    "nested": ((), [], {}, (1, [2.0, (None,)]), {"a": {"b": ({"c": "d"},)}}),
    "names": {"": 1, ".": np.ones(2), "..": np.zeros(2), "a/b": np.ones(1), "a.b": np.zeros(1),
              "%": np.ones(3), "%2E": np.ones(4), "ü": np.zeros(3), "number": np.ones(4), "\0": np.ones(5),
              "%number": np.ones(1), "a": {"b": np.full(2, 7.0)}, "n" * 300: np.ones(1)},
    "scalars": [np.float64(math.nan), np.int32(3), np.bool_(True), np.str_("x")],
}
ARRAYS = [
    np.arange(6).reshape(2, 3), np.array(3.5), np.zeros((0, 3)), np.zeros((3, 0), bool),
    np.array([True, False]),
    np.arange(3, dtype=">i2"), np.ones(2, "f2"), np.array([1j]), np.array([math.nan, -0.0]),
    np.arange(24.0).reshape(2, 3, 4).transpose(2, 0, 1), np.arange(9.0)[::3],
    np.array(["", "ü"]), np.array([b"a", b"bc"]), np.array("text"), np.array(["2020-01-01"], "M8[s]"),
    np.zeros(3, POINT), np.zeros((), POINT), np.zeros(0, POINT), np.ones(2, [("name", "U3"), ("x", "f4")]),
    np.ones(2, np.dtype([("a", "i1"), ("b", "f8")], align=True)), np.zeros(2, np.dtype([]))]


@pytest.mark.parametrize("name", VALUES)
def test_values_come_back_as_they_were(tmp_path, name):
    assert same(there_and_back(tmp_path, {name: VALUES[name]}), {name: VALUES[name]})


@pytest.mark.parametrize("array", ARRAYS, ids=lambda array: f"{array.dtype.str} {array.shape}")
def test_arrays_come_back_as_they_were(tmp_path, array):
    rows = np.atleast_1d(array)
    back = there_and_back(tmp_path, {"array": array, "table": Table({"of": rows})})
    assert same(back["array"], array) and same(back["table"].fields["of"], rows)
