"""States on disk: read is what was written, on any number of ranks; damage and full disks are noticed."""
import errno
import math
import os
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import mpm_dem_store as store
from mpm_dem_store import StoreError, Table

ROOT, ONE = Path(__file__).parents[1], MPI.COMM_SELF
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


def test_rows_are_stored_in_the_order_of_their_numbers(tmp_path):
    number, mass = np.array([70, -3, 12, 4], np.int32), np.array([3.0, 0.0, 2.0, 1.0])
    tree = {"points": Table({"mass": mass}, number), "no": Table({"x": np.zeros((0, 3))}, number[:0]),
            "only": Table({}, number), "nothing": Table({})}
    back = there_and_back(tmp_path, tree)
    assert same(back["points"], Table({"mass": np.arange(4.0)}, np.sort(number)))
    assert same(back["no"], tree["no"]) and same(back["only"], Table({}, np.sort(number)))
    assert same(back["nothing"], tree["nothing"])


@pytest.mark.parametrize("value, said", [
    (object(), "the state/a is of type object: give arrays"),
    ([{"b": {1}}], "the state/a/0/b is of type set: "),
    ({1: 2.0}, "the state/a has an entry with the name 1, of type int: "),
    (np.array([None]), "the state/a is an array of objects: "),
    (np.ma.array([1.0]), "the state/a is of type MaskedArray: "),
    (Table({"x": np.ones(2), "y": np.ones(3)}), "the state/a has fields that are no arrays of the same"),
    (Table({"x": [1.0]}), "the state/a has fields that are no arrays"),
    (Table({"x": np.ones(2)}, np.ones(2)), "the state/a has numbers of type float64 and shape (2,): "),
    (Table({"x": np.ones(2)}, np.array([5, 5])), "two rows of a table have the same number: give unique"),
], ids=lambda value: value if isinstance(value, str) else type(value).__name__)
def test_what_cannot_be_stored_is_refused(tmp_path, value, said):
    with pytest.raises(StoreError, match=re.escape(said)):
        store.write(tmp_path / "state.h5", {"a": value}, {}, ONE)
    assert not [*tmp_path.iterdir()]


def test_the_head_is_data_for_json(tmp_path):
    head = {"case": "slope", "time": 0.1, "parameters": {"dt": 1e-5, "name": "ü"}, "ranks": [1, None]}
    store.write(tmp_path / "a", {}, head, ONE)
    assert store.read_head(tmp_path / "a", ONE) == head and store.read(tmp_path / "a", ONE) == {}
    with pytest.raises(StoreError, match="head of a checkpoint is no data for JSON"):
        store.write(tmp_path / "b", {}, {"dt": np.float32(1.0)}, ONE)


@pytest.fixture
def written(tmp_path):
    """A file with a bit of everything."""
    path = tmp_path / "state.h5"
    points = Table({"F": np.ones((5, 3, 3))})
    store.write(path, {**VALUES, "arrays": ARRAYS, "points": points}, {"time": 1}, ONE)
    return path


def refused(path):
    """What both ways to read say, without the path."""
    said = []
    for way in store.read, store.read_head:
        with pytest.raises(StoreError) as caught:
            way(path, ONE)
        said.append(str(caught.value))
    assert said[0] == said[1] and said[0].startswith(f"{path} ") and "\n" not in said[0]
    return said[0][len(str(path)) + 1:]


def test_the_first_line_says_what_the_file_is(written):
    line = re.fullmatch(r"checkpoint of mpm-dem, format 1, crc32 [0-9a-f]{8} of the (\d+) bytes of HDF5 "
                        "after byte 512", written.read_bytes().split(b"\n")[0].decode())
    assert int(line[1]) == written.stat().st_size - 512


def test_what_is_no_checkpoint_is_refused(tmp_path, written):
    assert refused(tmp_path / "x").startswith("does not exist: give the name")
    assert refused(tmp_path).startswith("is a folder or device: give the name")
    other = tmp_path / "other"
    for content, said in ((b"", "is empty: take another checkpoint"), (b"time\n", "is no checkpoint"),
                          (written.read_bytes()[512:], "is no checkpoint of mpm-dem: give a file")):
        other.write_bytes(content)
        assert refused(other).startswith(said)
    newer = written.read_bytes().replace(b"format 1", b"format 2", 1)
    other.write_bytes(newer)
    assert refused(other) == "is of format 2, this program reads up to 1: update it"


def test_a_cut_or_longer_file_is_refused(written):
    content = written.read_bytes()
    for length in (40, 511, 512, 513, 2000, len(content) // 2, len(content) - 1):
        written.write_bytes(content[:length])
        assert refused(written).startswith(f"is truncated ({length} bytes of "), length
    written.write_bytes(content + b"\0")
    assert refused(written).startswith("is damaged (its first line and its size do not fit)")


def test_every_changed_byte_is_noticed(written):
    content, random = written.read_bytes(), np.random.default_rng(5)
    for place in [*range(512), *random.integers(512, len(content), 400)]:
        changed = bytearray(content)
        changed[place] ^= 1 << random.integers(8)
        written.write_bytes(changed)
        with pytest.raises(StoreError, match="is damaged|is truncated|is no checkpoint|is of format"):
            store.read(written, ONE)
    written.write_bytes(content)
    assert same(store.read(written, ONE)["nested"], VALUES["nested"])


def test_the_checksum_is_that_of_the_checksums_of_pieces(tmp_path, monkeypatch):
    """Of which the ranks have one each in turn."""
    monkeypatch.setattr(store, "SUMMED", 1000)
    store.write(tmp_path / "a", {"a": np.arange(1000.0)}, {}, ONE)
    content = (tmp_path / "a").read_bytes()
    sums = [zlib.crc32(content[start:start + 1000]) for start in range(512, len(content), 1000)]
    assert b"crc32 %08x" % zlib.crc32(struct.pack(f"<{len(sums)}I", *sums)) in content[:100] and len(sums) > 8
    assert same(store.read(tmp_path / "a", ONE)["a"], np.arange(1000.0))


def test_a_file_that_cannot_be_written_is_an_error_of_the_system(tmp_path, written):
    for path, number in ((tmp_path / "no" / "a", errno.ENOENT), (written / "a", errno.ENOTDIR),
                         (tmp_path, errno.EISDIR)):
        with pytest.raises(OSError) as caught:
            store.write(path, {"a": np.ones(3)}, {}, ONE)
        assert caught.value.errno == number and caught.value.filename == str(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["state.h5"]
    assert not Path(f"{tmp_path}.new").exists()


@pytest.fixture
def small_disk(disk):
    """A disk of 256 kB."""
    return disk("256k")


FILL = """
import os, shutil, sys, types
import numpy as np
import mpm_dem_store as store
path, tricks, kind = sys.argv[1:]
store.write(path, {"x": np.arange(9.0)}, {})
old = open(path, "rb").read()
if "estimate" in tricks:  # each way to notice it is taken away, down to the writing itself
    shutil.disk_usage = lambda folder: types.SimpleNamespace(free=1 << 60)
if "reserve" in tricks:
    os.posix_fallocate = lambda *what: None
rows = {f"x{k}": np.arange(1000.0) for k in range(100)}
try:
    store.write(path, {"rows": store.Table(rows) if kind == "table" else rows}, {})
except OSError as error:
    print(error)
assert os.listdir(os.path.dirname(path)) == ["state.h5"] and open(path, "rb").read() == old
assert (store.read(path)["x"] == np.arange(9.0)).all()
"""


@pytest.mark.parametrize("kind", ["table", "arrays"])
@pytest.mark.parametrize("without", ["nothing", "estimate", "estimate and reserve"])
def test_a_full_disk_is_an_error_and_leaves_the_old_file(small_disk, without, kind):
    done = subprocess.run([sys.executable, "-c", FILL, small_disk / "state.h5", without, kind], text=True,
                          capture_output=True, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"[Errno 28] No space left on device: '{small_disk}/state.h5'\n"


RANKS = """
import sys
import h5py
import numpy as np
from mpi4py import MPI
import mpm_dem_store as store
from mpm_dem_store import Table

comm, folder = MPI.COMM_WORLD, sys.argv[1]
store.PIECE = 1000  # so that there are several
number = np.random.default_rng(1).permutation(900)[:301]
own = np.split(number, [0, 200])[comm.rank]  # none, many, some
u = np.full((comm.rank + 1, 2), comm.rank)
points = Table({"x": own[:, None] * [1.0, 2.0, 3.0], "name": own.astype("U5"),
                "e": np.ones((len(own), 0))}, own)
few = Table({"one": own[own == number[-1]] * 1.0}, own[own == number[-1]])
tree = {"points": points, "few": few, "u": Table({"rank": u}), "a": np.arange(600.0) + comm.rank, "t": 0.5}
size = store.write(folder + "/three", tree, {})
for name in "three", "one":
    back = store.read(folder + "/" + name)
    part = np.sort(number)[301 * comm.rank // 3:301 * (comm.rank + 1) // 3]
    assert (back["points"].number == part).all()
    assert (back["points"].fields["name"] == part.astype("U5")).all()
    assert (back["points"].fields["x"] == part[:, None] * [1.0, 2.0, 3.0]).all()
    assert (back["a"] == np.arange(600.0)).all() and back["t"] == 0.5 and size > 20000
    assert back["u"].fields["rank"].tolist() == ([[comm.rank] * 2] * (comm.rank + 1) if name == "three" else
                                                 [[], [], [[0, 0]]][comm.rank])
    assert comm.allreduce(len(back["few"].number)) == 1

def said(work, *arguments):
    try:
        work(*arguments)
    except (store.StoreError, OSError) as error:
        return type(error).__name__ + " " + str(error)

twice = np.array([1, 2]) if comm.rank == 2 else np.array([1])
wrong = {"a": Table({"x": np.ones(2, "f4" if comm.rank == 2 else "f8")})}
bad = {"a": object() if comm.rank == 1 else 1.0}
everything = [said(store.write, folder + "/a", {"a": Table({}, twice)}, {}),
              said(store.write, folder + "/a", wrong, {}), said(store.write, folder + "/a", bad, {}),
              said(store.write, folder + "/no/a", {"a": 1}, {}), said(store.read, folder + "/damaged"),
              said(store.read, folder + "/no")]
assert None not in everything and comm.allgather(everything) == 3 * [everything], everything
if comm.rank == 0:
    print(h5py.get_config().mpi)
"""


def data_sets(path):
    """name → bytes of all that is the same for any number of ranks."""
    import h5py
    found = {}
    with h5py.File(path, "r") as file:
        file["data"].visititems(lambda name, item: found.update(
            {name: item[()].tobytes()} if isinstance(item, h5py.Dataset) else {}))
    return found


@pytest.mark.mpi
@pytest.mark.parametrize("by", ["rank 0", "each rank"])
def test_a_state_does_not_depend_on_the_ranks(tmp_path, run_ranks, by):
    """Rows are written by rank 0, or by each rank where h5py is built with MPI."""
    built = subprocess.run([sys.executable, "-c", "import h5py; print(h5py.get_config().mpi)"], text=True,
                           capture_output=True, env={**os.environ, "H5PY_ALWAYS_USE_MPI": "1"}).stdout.strip()
    if built != str(by == "each rank"):
        pytest.skip(f"h5py is built {'with' if built == 'True' else 'without'} MPI")
    number = np.random.default_rng(1).permutation(900)[:301]
    points = Table({"x": number[:, None] * [1.0, 2.0, 3.0], "name": number.astype("U5"),
                    "e": np.ones((301, 0))}, number)
    store.write(tmp_path / "one", {"points": points, "few": Table({"one": number[-1:] * 1.0}, number[-1:]),
                                   "u": Table({"rank": np.zeros((1, 2), int)}), "a": np.arange(600.0),
                                   "t": 0.5}, {}, ONE)
    content = bytearray((tmp_path / "one").read_bytes())
    content[-5] ^= 1
    (tmp_path / "damaged").write_bytes(content)
    done = run_ranks(3, "-c", RANKS, tmp_path)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", f"{built}\n")
    one, three = data_sets(tmp_path / "one"), data_sets(tmp_path / "three")
    del one["u/rank"], three["u/rank"]
    assert one == three and len(one) == 6 and not [*tmp_path.glob("*.new")]
