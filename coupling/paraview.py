"""ParaView time series: VTU files, one per time and rank, and a PVD file that lists them, replaced so that it is always
whole."""
from pathlib import Path

import numpy as np


class ParaView:
    """The time series of one run in ``folder``, by name; ``suffix`` ends their names. Every rank of ``comm`` writes
    what it has, rank 0 lists the files. On one rank they are called NAME_TIME.vtu, on several NAME_TIME_RANK.vtu."""

    def __init__(self, folder, suffix, comm):
        self._folder, self._suffix, self._comm, self._series = folder, suffix, comm, {}

    def add(self, time, parts):
        """One time [s]; parts: name → (points, cells, data) of this rank, see ``Series.add``. Collective."""
        comm, alone = self._comm, self._comm.size == 1
        for name, part in parts.items():
            self._of(name).write(*part, rank=None if alone else comm.rank)
        there = comm.allgather(list(parts))  # so that the list names no file that is not written to its end
        for name in dict.fromkeys(sum(there, [])):
            if comm.rank == 0:
                ranks = [rank for rank, names in enumerate(there) if name in names]
                self._of(name).list(time, [None] if alone else ranks)
            self._of(name).count += 1

    def _of(self, name):
        return self._series.setdefault(name, Series(self._folder, name + self._suffix))


class Series:
    """The time series NAME.pvd in ``folder``. ``count``: times so far, the number of the next files."""

    def __init__(self, folder, name):
        self._folder, self._name, self._entries, self.count = Path(folder), name, [], 0

    def add(self, time, x, cells, data):
        """One time [s]: points x, shape (n, 2 or 3), cells {type: (m, k) connectivity}, data name → (n, …) array."""
        self.write(x, cells, data)
        self.list(time)
        self.count += 1

    def _file(self, rank):
        return f"{self._name}_{self.count:05d}{'' if rank is None else f'_{rank:04d}'}.vtu"

    def write(self, x, cells, data, rank=None):
        """The next file, or the piece of it that belongs to ``rank``."""
        import meshio  # 0.2 s that a run without ParaView files saves

        x = _in_space(np.asarray(x, float))
        data = {name: _in_space(np.asarray(values)) for name, values in data.items()}
        cells = [(kind, np.asarray(c)) for kind, c in cells.items()]
        meshio.Mesh(x, cells, point_data=data).write(self._folder / self._file(rank))

    def list(self, time, ranks=(None,)):
        """Name the next files, pieces of ``ranks``, in the PVD file."""
        for rank in ranks:
            part = "" if rank is None else f'part="{rank}" '
            self._entries.append(f'<DataSet timestep="{time:.12g}" {part}file="{self._file(rank)}"/>')
        text = "\n".join(['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>",
                          *self._entries, "</Collection>", "</VTKFile>", ""])
        fresh = self._folder / f"{self._name}.pvd.new"
        fresh.write_text(text, encoding="utf-8")
        fresh.replace(self._folder / f"{self._name}.pvd")


def _in_space(values):
    """Vectors and tensors with three components per direction, as ParaView wants them."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    if values.ndim == 3:
        full = np.zeros((len(values), 3, 3))
        full[:, :values.shape[1], :values.shape[2]] = values
        return full.reshape(len(values), 9)
    return values
