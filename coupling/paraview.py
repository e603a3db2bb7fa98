"""ParaView time series: one VTU file per time and a PVD file that lists them, replaced so that it is always whole."""
from pathlib import Path

import numpy as np


class Series:
    """The time series NAME.pvd in ``folder``."""

    def __init__(self, folder, name):
        self._folder, self._name, self._entries = Path(folder), name, []

    def add(self, time, x, cells, data):
        """One time [s]: points x, shape (n, 2 or 3), cells {type: (m, k) connectivity}, data name → (n, …) array."""
        import meshio  # 0.2 s that a run without ParaView files saves

        x = _in_space(np.asarray(x, float))
        data = {name: _in_space(np.asarray(values)) for name, values in data.items()}
        file = f"{self._name}_{len(self._entries):05d}.vtu"
        meshio.Mesh(x, [(kind, np.asarray(c)) for kind, c in cells.items()], point_data=data).write(self._folder / file)
        self._entries.append(f'<DataSet timestep="{time:.12g}" file="{file}"/>')
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
