"""States of a run on disk: one HDF5 file of data, the same for any number of ranks. All packages may use it.

The file begins with a line of text, alone in a block of 512 bytes: format, checksum and number of bytes of
what follows. That is HDF5: the texts ``head`` and ``tree`` (JSON; ``tree`` tells what the state is made of,
type by type) and the group ``data`` with the arrays, contiguous and not compressed, so that they are written
and read at the speed of the disk. No part of the file is ever run as code.
"""
import errno
import json
import math
import os
import re
import shutil
import zlib
from contextlib import ExitStack, suppress
from io import FileIO
from typing import Union

import numpy as np
from mpi4py import MPI

from mpm_dem_tree import Plan, StoreError, Table, Tree, columns_of, decode, raw, size_of, stored

__all__ = ["FORMAT", "StoreError", "Table", "Tree", "read", "read_head", "write"]

FORMAT = 1
BLOCK = 512  # bytes of text before HDF5, which looks for its own beginning at 0, 512, 1024, …
PIECE = 1 << 24  # bytes that go at once to the disk or to another rank
SUMMED = 1 << 24  # bytes of which a checksum is made at once
OTHER = "take another checkpoint, or start the run anew"
LINE = "checkpoint of mpm-dem, format {}, crc32 {:08x} of the {} bytes of HDF5 after byte 512\n"

Path = Union[str, "os.PathLike[str]"]


def write(path: Path, tree: Tree, head: dict, comm: MPI.Comm = MPI.COMM_WORLD) -> int:
    """Write a state to ``path``, with the data ``head`` for JSON; size of the file [bytes]. Collective.

    tree: name → array, number, text, truth value, None, ``Table``, or tuple, list or dict of these. Tables
    come from all ranks and are stored in the order of their numbers, all else comes from rank 0. The new file
    replaces what is at ``path`` once it is complete and on the disk. StoreError when something in the tree
    cannot be stored, OSError when the file cannot be written: both on all ranks, with the old file as it was.

    >>> size = write("state.h5", {"points": Table({"v": np.ones((3, 2))}, np.arange(3))}, {"time": 0.5})
    >>> read("state.h5")["points"].fields["v"].shape, read_head("state.h5")
    ((3, 2), {'time': 0.5})
    """
    path, first = os.fsdecode(path), comm.rank == 0
    new = f"{path}.new"
    plan = _on_all(comm, path, lambda: Plan(tree, head))
    orders = plan.share(comm)
    try:
        _on_all(comm, path, lambda: first and _prepare(new, plan))
        sink = _Sink(new, comm)
        for spec, table, order in zip(plan.specs, plan.tables, orders):
            sink.add(spec, table, order)
        _on_all(comm, path, sink.close)
        size = comm.bcast(_on_all(comm, path, lambda: first and os.path.getsize(new)))
        block = _block(_checksum(new, path, size, comm), size)
        _on_all(comm, path, lambda: first and _finish(new, path, block))
    finally:
        if first:
            with suppress(OSError):  # it has become the file itself
                os.unlink(new)
    return size


def read(path: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> Tree:
    """The state that ``write`` wrote. Collective. StoreError, the same on all ranks, when there is none.

    A rank gets an even part of the rows of a table, in the order of their numbers; of a table without numbers
    the rows it wrote when there are as many ranks as then.
    """
    return _read(path, comm, lambda file: decode(json.loads(file["tree"][()]), file, comm))


def read_head(path: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> dict:
    """The ``head`` of that file, all of which is checked as by ``read``. Collective."""
    return _read(path, comm, lambda file: json.loads(file["head"][()]))


def _read(path, comm, get):
    import h5py

    path = os.fsdecode(path)
    try:
        size, crc = comm.bcast(_on_all(comm, path, lambda: _look(path) if comm.rank == 0 else None))
        if _checksum(path, path, size, comm) != crc:
            raise StoreError(f"{path} is damaged (its checksum is wrong): {OTHER}")
        with _on_all(comm, path, lambda: h5py.File(path, "r")) as file:
            return _on_all(comm, path, lambda: get(file))
    except OSError as error:
        raise StoreError(f"{path} cannot be read ({error.strerror or error}): look at its owner, and whether "
                         "all ranks see this disk") from error


def _look(path):
    """Size [bytes] and checksum as the first block has them. StoreError when this is no whole file."""
    if not os.path.isfile(path):
        is_what = "is a folder or device" if os.path.exists(path) else "does not exist"
        raise StoreError(f"{path} {is_what}: give the name of the file of a checkpoint")
    size = os.path.getsize(path)
    if size == 0:
        raise StoreError(f"{path} is empty: {OTHER}")
    with open(path, "rb") as file:
        block = file.read(BLOCK)
    found = re.match(rb"checkpoint of mpm-dem, format (\d+)(, crc32 ([0-9a-f]{8}) of the (\d+))?", block)
    if not found:
        raise StoreError(f"{path} is no checkpoint of mpm-dem: give a file that a run wrote as one")
    if int(found[1]) > FORMAT:
        raise StoreError(f"{path} is of format {int(found[1])}, this program reads up to {FORMAT}: update it")
    crc, whole = (int(found[3], 16), BLOCK + int(found[4])) if found[2] else (0, size)
    if size < max(whole, BLOCK):
        raise StoreError(f"{path} is truncated ({size} bytes of {max(whole, BLOCK)}): {OTHER}")
    if size > whole or block != _block(crc, size):
        raise StoreError(f"{path} is damaged (its first line and its size do not fit): {OTHER}")
    return size, crc


def _block(crc, size):
    """The first block of a file of ``size`` bytes: a line of text, filled up with blanks."""
    return LINE.format(FORMAT, crc, size - BLOCK).encode().ljust(BLOCK - 1) + b"\n"


def _checksum(file_name, path, size, comm):
    """Checksum of all but the first block: of those of its pieces, which the ranks share out. Collective."""
    def own():
        with open(file_name, "rb") as file:
            starts = range(BLOCK + comm.rank * SUMMED, size, comm.size * SUMMED)
            return [zlib.crc32(file.read(SUMMED)) for start in starts if file.seek(start)]

    parts = comm.allgather(_on_all(comm, path, own))
    sums = [parts[k % comm.size][k // comm.size] for k in range(sum(map(len, parts)))]
    return zlib.crc32(np.array(sums, "<u4").tobytes())


def _prepare(new, plan):
    """Make the file with all but the rows of tables, and take the space for these, or OSError."""
    import h5py

    need = plan.need()
    with suppress(FileNotFoundError):
        os.unlink(new)
    if need > shutil.disk_usage(os.path.dirname(new) or ".").free:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with _Disk(new, "x+b") as disk, h5py.File(disk, "w", userblock_size=BLOCK) as file:
        try:
            os.posix_fallocate(disk.fileno(), 0, need)
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):  # others: not on this kind of disk
                raise
        plan.fill(file)  # HDF5 shortens the file to what it needs when it is closed


def _finish(new, path, block):
    """Put the first block in, see that all is on the disk, and give the file its name."""
    with open(new, "r+b", buffering=0) as file:
        file.write(block)
        os.fsync(file.fileno())
    os.replace(new, path)
    folder = os.open(os.path.dirname(path) or ".", os.O_RDONLY)
    os.fsync(folder)
    os.close(folder)


class _Disk(FileIO):
    """A file for HDF5, which crashes the process when it cannot write: the first error waits for the end and
    what comes after it is dropped."""

    error = None

    def write(self, data):
        left = memoryview(data)
        try:
            while left and self.error is None:
                left = left[super().write(left):]
        except OSError as error:
            self.error = error

    def __exit__(self, *raised):
        self.close()
        if self.error is not None:
            raise self.error


class _Sink:
    """The file while rows go into it: each rank writes its own where h5py knows MPI, else rank 0 all. An
    error of one rank waits for ``close``, so that no other rank waits for this one."""

    def __init__(self, name, comm):
        import h5py

        self.comm, self.error, self.open = comm, None, ExitStack()
        self.shared = comm.size > 1 and bool(h5py.get_config().mpi)
        if self.shared:
            self.file = self._try(self._opened, h5py.File, name, "r+", "mpio", comm=comm)
        elif comm.rank == 0:
            disk = self._try(self._opened, _Disk, name, "r+b")
            self.file = self._try(self._opened, h5py.File, disk, "r+")

    def _opened(self, kind, *arguments, **keys):
        return self.open.enter_context(kind(*arguments, **keys))

    def _try(self, work, *arguments, **keys):
        if self.error is None:
            try:
                return work(*arguments, **keys)
            except Exception as error:
                self.error = error

    def close(self):
        """Close the file, and raise the first error of this rank."""
        self.open.close()
        if self.error is not None:
            raise self.error

    def add(self, spec, table, order):
        """The rows of all ranks. Collective."""
        bounds = order.bounds if order else np.cumsum([0, *spec["counts"]])
        for (_, column), rows in zip(spec["columns"], columns_of(table).values()):
            if size_of(column):
                self._put(column["place"], order(rows) if order else rows, bounds.tolist())

    def _put(self, place, rows, bounds):
        """Write rows bounds[r]..bounds[r + 1] of each rank r, piece by piece."""
        me, rows = self.comm.rank, np.ascontiguousarray(rows).view(stored(rows.dtype))
        step = max(1, PIECE // (rows.dtype.itemsize * math.prod(rows.shape[1:])))
        for rank in range(self.comm.size) if me == 0 and not self.shared else [me]:
            for start in range(bounds[rank], bounds[rank + 1], step):
                end = min(start + step, bounds[rank + 1])
                if rank == me:
                    piece = rows[start - bounds[rank]:end - bounds[rank]]
                else:
                    piece = np.empty((end - start, *rows.shape[1:]), rows.dtype)
                    self.comm.Recv(raw(piece), rank)
                if self.shared or me == 0:
                    self._try(self._write, place, piece, start, end)
                else:
                    self.comm.Send(raw(piece), 0)

    def _write(self, place, piece, start, end):
        self.file[place].write_direct(piece, dest_sel=np.s_[start:end])


def _on_all(comm, path, work):
    """What ``work()`` gives on this rank. Where it fails on any, the error of the first of them on all:
    StoreError and MemoryError as they are, all others as OSError. Collective, ``work`` is not."""
    result = error = caught = None
    try:
        result = work()
    except (StoreError, MemoryError) as raised:
        error = caught = raised
    except Exception as raised:
        found = re.search(r"errno = (\d+)", str(raised))  # in the words of HDF5
        caught, number = raised, int(found[1]) if found else getattr(raised, "errno", None)
        error = OSError(number, os.strerror(number), path) if number else OSError(f"{path}: {raised}")
    failed = [one for one in comm.allgather(error) if one is not None]
    if failed:
        raise failed[0] from caught
    return result
