"""ParaView time series: VTU files, one per time and rank, and a PVD file that lists them, replaced so that it
is always whole."""
import re
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional, Sequence, Tuple, Union

import numpy as np
from mpi4py import MPI

from .results import Results
from .sharing import on_each, on_first
from .writing import replace_text, writing

Piece = Union[Tuple[Any, dict, dict],  # points, cells by type, data of the points by name
              Tuple[Any, dict, dict, dict]]  # and data of the cells
FILE = re.compile(r"(.+?)_\d{5,}(_\d{4,})?\.vtu")  # name of the series, number of the time, rank


class ParaView:
    """The time series of one run, by name; ``suffix`` ends their names. Every rank of ``comm`` writes what it
    has, rank 0 lists the files. On one rank they are called NAME_TIME.vtu, on several NAME_TIME_RANK.vtu.
    results: the ``Results`` that they are part of."""

    def __init__(self, results: Results, suffix: str, comm: MPI.Comm) -> None:
        self._results, self._suffix, self._comm = results, suffix, comm
        self._series: Dict[str, Series] = {}

    def add(self, time: float, parts: Dict[str, Piece]) -> None:
        """One time [s]; parts: name → ``Piece`` of this rank, see ``Series.add``. Collective."""
        comm, alone = self._comm, self._comm.size == 1
        there = comm.allgather(list(parts))
        ranks = {name: [None] if alone else [rank for rank, names in enumerate(there) if name in names]
                 for name in dict.fromkeys(sum(there, []))}

        def announce() -> None:
            for name in ranks:
                self._results.add(*self._of(name).files(ranks[name]))

        def write() -> None:
            for name, part in parts.items():
                self._of(name).write(*part[:3], part[3] if len(part) == 4 else None,
                                     None if alone else comm.rank)

        def list_them() -> None:
            for name in ranks:
                self._of(name).list(time, ranks[name])

        on_first(comm, announce)
        on_each(comm, write)  # so that the list names no file that is not written to its end
        on_first(comm, list_them)
        for name in ranks:
            self._of(name).count += 1

    def get_state(self) -> Dict[str, Tuple[str, int]]:
        """Of each series by name: the entries of its list so far, and the number of times. On rank 0."""
        return {name: series.get_state() for name, series in self._series.items()}

    def set_state(self, state: Dict[str, Tuple[str, int]]) -> None:
        """Go on after these times."""
        for name, of_series in state.items():
            self._of(name).set_state(of_series)

    def files(self) -> List[str]:
        """Names of the files so far, without the lists."""
        return [file for series in self._series.values() for file in series.written()]

    def later(self, names: Iterable[str]) -> List[str]:
        """Those of the ``names`` that are files of the series and not among ``files``."""
        series, so_far = {name + self._suffix for name in self._series}, set(self.files())
        numbered = ((name, FILE.fullmatch(name)) for name in names)
        return [name for name, found in numbered if found and found[1] in series and name not in so_far]

    def relist(self) -> None:
        """Write the lists anew, of the times so far. On rank 0."""
        for series in self._series.values():
            series.write_list()

    def _of(self, name: str) -> "Series":
        return self._series.setdefault(name, Series(self._results, name + self._suffix))


class Series:
    """The time series NAME.pvd in ``folder``, a path or ``Results``. ``count``: times so far, the number of
    the next files."""

    def __init__(self, folder: Union[str, Path, Results], name: str) -> None:
        self._path = folder.path if isinstance(folder, Results) else Path(folder).joinpath
        self._replace = folder.replace_text if isinstance(folder, Results) else self._replace_alone
        self._name, self.count = name, 0
        self._entries: List[str] = []

    def add(self, time: float, x: np.ndarray, cells: dict, data: dict,
            of_cells: Optional[dict] = None) -> None:
        """One time [s]: points x, shape (n, 2 or 3), cells {type: (m, k) connectivity}, data name → (n, …)
        array; of_cells: name → (m, …) array, where there is one type."""
        self.write(x, cells, data, of_cells)
        self.list(time)
        self.count += 1

    def files(self, ranks: Sequence[Optional[int]] = (None,)) -> List[str]:
        """Names of the next files of these ranks, and of their list."""
        return [*map(self._file, ranks), f"{self._name}.pvd"]

    def _file(self, rank: Optional[int]) -> str:
        return f"{self._name}_{self.count:05d}{'' if rank is None else f'_{rank:04d}'}.vtu"

    def write(self, x: np.ndarray, cells: dict, data: dict, of_cells: Optional[dict] = None,
              rank: Optional[int] = None) -> None:
        """The next file, or the piece of it that belongs to ``rank``."""
        import meshio  # 0.2 s that a run without ParaView files saves

        x = _in_space(np.asarray(x, float))
        data = {name: _in_space(np.asarray(values)) for name, values in data.items()}
        own = {name: [_in_space(np.asarray(values))] for name, values in (of_cells or {}).items()}
        path = self._path(self._file(rank))
        with writing(path):
            meshio.Mesh(x, [(kind, np.asarray(c)) for kind, c in cells.items()], point_data=data,
                        cell_data=own).write(path)

    def list(self, time: float, ranks: Sequence[Optional[int]] = (None,)) -> None:
        """Name the next files, pieces of ``ranks``, in the PVD file."""
        for rank in ranks:
            part = "" if rank is None else f'part="{rank}" '
            self._entries.append(f'<DataSet timestep="{time:.12g}" {part}file="{self._file(rank)}"/>')
        self.write_list()

    def write_list(self) -> None:
        """The PVD file, of the times so far."""
        text = "\n".join(['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">',
                          "<Collection>", *self._entries, "</Collection>", "</VTKFile>", ""])
        self._replace(f"{self._name}.pvd", text)

    def get_state(self) -> Tuple[str, int]:
        """Entries of the list so far, a line each, and the number of times."""
        return "\n".join(self._entries), self.count

    def set_state(self, state: Tuple[str, int]) -> None:
        """Go on after these times."""
        entries, self.count = state
        self._entries = entries.splitlines()

    def written(self) -> List[str]:
        """Names of the files of the times so far."""
        return [re.findall('file="([^"]*)"', entry)[0] for entry in self._entries]

    def _replace_alone(self, name: str, text: str) -> None:
        replace_text(self._path(name), text)


def _in_space(values: np.ndarray) -> np.ndarray:
    """Vectors and tensors with three components per direction, as ParaView wants them."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    if values.ndim == 3:
        full = np.zeros((len(values), 3, 3))
        full[:, :values.shape[1], :values.shape[2]] = values
        return full.reshape(len(values), 9)
    return values
