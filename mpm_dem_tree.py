"""What a state of a run is made of, as data: its description for JSON, and rows that the ranks share out.

``mpm_dem_store`` writes it and reads it again.
"""
import ast
import json
import math
import struct
from contextlib import suppress
from typing import Any, Dict, NamedTuple, NoReturn, Optional
from urllib.parse import quote

import numpy as np
from mpi4py import MPI

Tree = Dict[str, Any]


class StoreError(ValueError):
    """A file that holds no state or a damaged one, or a tree that cannot be stored."""


class Table(NamedTuple):
    """Rows that the ranks share out, such as points.

    fields: name → rows of this rank, shape (n, …), the same names and types on all ranks; number: numbers of
    these rows in the whole, unique, gaps allowed, shape (n,), or None where the order means nothing.

    >>> points = Table({"mass": np.ones(2)}, np.array([7, 3]))
    """

    fields: Dict[str, np.ndarray]
    number: Optional[np.ndarray] = None


class Plan:
    """What is to be written. ``tree``: the state as data for JSON, with type, shape and place in the file of
    arrays (``arrays``, each with its values) and of the columns of ``tables`` (described by ``specs``)."""

    def __init__(self, tree, head):
        self.arrays, self.tables, self.specs = [], [], []
        self.tree = self._encode(tree, "data", "the state")
        try:
            self.head = json.dumps(head)
        except (TypeError, ValueError) as error:
            raise StoreError(f"the head of a checkpoint is no data for JSON ({error})") from error

    def share(self, comm):
        """Note how many rows all ranks have; order of each table, None without numbers. Collective.
        StoreError when the tables differ between the ranks, or numbers are not unique."""
        if not comm.allreduce(comm.bcast(self.specs) == self.specs, MPI.LAND):
            raise StoreError("the tables of a state differ between the ranks: give the same names, types and "
                             "shapes on all of them")
        own = [len(next(iter(columns_of(table).values()), ())) for table in self.tables]
        for spec, *counts in zip(self.specs, *comm.allgather(own)):
            if not spec["numbered"]:
                spec["counts"] = counts
            for _, column in spec["columns"]:
                column["shape"][0] = sum(counts)
        return [None if table.number is None else Order(table.number, comm) for table in self.tables]

    def columns(self):
        """Descriptions of all columns of tables."""
        return [column for spec in self.specs for _, column in spec["columns"]]

    def need(self):
        """Bytes of the file, at most: a group of HDF5 has 1000, the description of an array some 300."""
        specs = [*self.columns(), *(spec for spec, _ in self.arrays)]
        data = sum(size_of(spec) + 2000 * (1 + spec["place"].count("/")) for spec in specs)
        return 10000 + 4 * len(json.dumps(self.tree)) + len(self.head) + data

    def fill(self, file):
        """Write all but the rows of tables, and make room for these, into an open file."""
        import h5py

        layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        layout.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        layout.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        for name, text in (("head", self.head), ("tree", json.dumps(self.tree))):
            file.create_dataset(name, data=np.bytes_(text))
        for spec in filter(size_of, self.columns()):
            file.create_dataset(spec["place"], spec["shape"], stored(dtype_of(spec)), dcpl=layout)
        for spec, array in self.arrays:
            if array.nbytes:
                file.create_dataset(spec["place"], data=array.view(stored(array.dtype)))

    def _encode(self, value, place, name):
        kind = type(value)
        if value is None or kind in (bool, int, str) or (kind is float and math.isfinite(value)):
            return value
        if kind is float:
            return {"float": struct.pack(">d", value).hex()}
        if kind is dict:
            return {"dict": {key: self._encode(entry, _inside(place, key, name), f"{name}/{key}")
                             for key, entry in value.items()}}
        if kind in (list, tuple):
            entries = [self._encode(entry, f"{place}/{k}", f"{name}/{k}") for k, entry in enumerate(value)]
            return entries if kind is list else {"tuple": entries}
        if kind is Table:
            return {"table": self._encode_table(value, place, name)}
        if kind is np.ndarray or isinstance(value, np.generic):
            spec = _spec(np.asarray(value), place, name)
            self.arrays.append((spec, np.ascontiguousarray(value).reshape(spec["shape"])))
            return {"array" if kind is np.ndarray else "scalar": spec}
        _refuse(name, f"is of type {kind.__name__}")

    def _encode_table(self, table, place, name):
        number, columns = table.number, columns_of(table)
        if any(type(rows) is not np.ndarray or rows.ndim == 0 for rows in columns.values()) or len(
                {len(rows) for rows in columns.values()}) > 1:
            _refuse(name, "has fields that are no arrays of the same length")
        if number is not None and (number.ndim != 1 or not np.can_cast(number.dtype, np.int64)):
            _refuse(name, f"has numbers of type {number.dtype} and shape {number.shape}")
        places = [*(_inside(place, key, name) for key in table.fields), f"{place}/%number"]
        spec = {"numbered": number is not None, "columns": [
            [key, _spec(rows[:0], at, f"{name}/{key}")] for at, (key, rows) in zip(places, columns.items())]}
        self.tables.append(table)
        self.specs.append(spec)
        return spec


def columns_of(table):
    """name → rows; the numbers, where there are any, have the name None."""
    return {**table.fields, **({} if table.number is None else {None: table.number})}


def _inside(place, key, name):
    """Place of an entry: a name in HDF5 has no slash and is neither empty nor a dot."""
    if type(key) is not str:
        _refuse(name, f"has an entry with the name {key!r}, of type {type(key).__name__}")
    return f"{place}/{ {'': '%', '.': '%2E'}.get(key) or quote(key, ' ()[],:', errors='surrogatepass')}"


def _spec(array, place, name):
    if array.dtype.hasobject:
        _refuse(name, "is an array of objects")
    description = repr(np.lib.format.dtype_to_descr(array.dtype))
    return {"place": place, "dtype": description, "shape": list(array.shape)}


def _refuse(name, what) -> NoReturn:
    raise StoreError(f"{name} {what}: give arrays, numbers, texts, None, tables, and tuples, lists and dicts "
                     "of these")


def dtype_of(spec):
    """Type of the entries of an array that ``_spec`` has described."""
    return np.lib.format.descr_to_dtype(ast.literal_eval(spec["dtype"]))


def size_of(spec):
    """Bytes."""
    return dtype_of(spec).itemsize * math.prod(spec["shape"])


def stored(dtype):
    """The type in the file: the same where HDF5 has it, else plain bytes, as of texts of fixed length."""
    import h5py

    with suppress(TypeError):
        if h5py.h5t.py_create(dtype, logical=True).dtype == dtype:
            return dtype
    return np.dtype(f"V{dtype.itemsize}") if dtype.itemsize else dtype


def raw(array):
    """The bytes of a contiguous array, shape (n,)."""
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8)


def _ascending(number):
    """Index that sorts them; of numbers that are sorted it copies nothing."""
    return slice(None) if (number[1:] > number[:-1]).all() else np.argsort(number, kind="stable")


def _starts(counts):
    return np.cumsum(counts) - counts


def decode(node, file, comm):
    """The state, or part of it, that ``node`` of ``Plan.tree`` describes, out of an open file."""
    if type(node) is list:
        return [decode(entry, file, comm) for entry in node]
    if type(node) is not dict:
        return node
    (kind, content), = node.items()
    if kind == "float":
        return struct.unpack(">d", bytes.fromhex(content))[0]
    if kind == "dict":
        return {key: decode(entry, file, comm) for key, entry in content.items()}
    if kind == "tuple":
        return tuple(decode(entry, file, comm) for entry in content)
    if kind == "table":
        return _decode_table(content, file, comm)
    array = _load(file, content, content["shape"], ())
    return array if kind == "array" else array[()]


def _decode_table(spec, file, comm):
    total = spec["columns"][0][1]["shape"][0] if spec["columns"] else 0
    start, end = (total * k // comm.size for k in (comm.rank, comm.rank + 1))
    counts = spec.get("counts", ())
    if len(counts) == comm.size:
        start, end = sum(counts[:comm.rank]), sum(counts[:comm.rank + 1])
    fields = {key: _load(file, column, [end - start, *column["shape"][1:]], np.s_[start:end])
              for key, column in spec["columns"]}
    return Table(fields, fields.pop(None, None))


def _load(file, spec, shape, where):
    result = np.empty(shape, dtype_of(spec))
    if result.nbytes:
        data = file[spec["place"]]
        data.read_direct(result.view(stored(result.dtype)), source_sel=where)
    return result


class Order:
    """Brings rows into the order of their numbers, and an even part of them to each rank: positions bounds[r]
    to bounds[r + 1] to rank r. Collective, as is each call."""

    def __init__(self, number, comm):
        self.comm, self.order = comm, _ascending(number)
        self.bounds = np.arange(comm.size + 1) * comm.allreduce(len(number)) // comm.size
        ends = self._ends(number[self.order].astype(np.int64, copy=False))
        self.sent = np.diff(ends, prepend=0, append=len(number))
        self.received = np.empty_like(self.sent)
        comm.Alltoall(self.sent, self.received)
        self.back = slice(None)
        number = self(number)
        self.back = _ascending(number)
        number = number[self.back]
        if not comm.allreduce(bool((number[1:] > number[:-1]).all()), MPI.LAND):
            raise StoreError("two rows of a table have the same number: give unique numbers")

    def _ends(self, number):
        """How many of the ascending numbers of this rank belong to the ranks up to each but the last, by
        bisection for the largest number of each."""
        least, most = np.iinfo(np.int64).min, np.iinfo(np.int64).max
        wanted = self.bounds[1:-1]
        low = np.full_like(wanted, self.comm.allreduce(number[0] if len(number) else most, MPI.MIN))
        high = np.full_like(wanted, self.comm.allreduce(number[-1] if len(number) else least, MPI.MAX))
        while (low < high).any():
            middle = (low & high) + ((low ^ high) >> 1)  # their mean, rounded down, without overflow
            enough = self.comm.allreduce(np.searchsorted(number, middle, "right")) >= wanted
            low, high = np.where(enough | (low >= high), low, middle + 1), np.where(enough, middle, high)
        return np.where(wanted > 0, np.searchsorted(number, low, "right"), 0)

    def __call__(self, rows):
        """The rows that this rank has then."""
        mine = rows[self.order]
        if self.comm.size == 1:
            return mine
        result = np.empty((self.received.sum(), *rows.shape[1:]), rows.dtype)
        row = MPI.BYTE.Create_contiguous(rows.dtype.itemsize * math.prod(rows.shape[1:])).Commit()
        self.comm.Alltoallv([raw(mine), (self.sent, _starts(self.sent)), row],
                            [raw(result), (self.received, _starts(self.received)), row])
        row.Free()
        del mine  # at most two copies of a field at a time
        return result[self.back]
