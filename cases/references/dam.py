"""A dam that breaks on a dry bed: the experiment of Martin & Moyce 1952, what comes out beside it, figure.

J. C. Martin & W. J. Moyce, An experimental study of the collapse of liquid columns on a rigid horizontal
plane, Phil. Trans. R. Soc. A 244, 1952, doi 10.1098/rsta.1952.0006: columns of water of width a and height
n^2 a. The article was not at hand. Numbers for n^2 = 2, its table 2, are those that three open codes of fluid
dynamics carry alike (Ocellaris, Lethe and, read off figure 3, PySPH); for n^2 = 1 two agree, one from the
markers of figure 7 of Leakey et al. 2021 (arXiv 2108.08769 repeats the scene), one from the article's means.
"""
from pathlib import Path
from typing import Dict, Tuple

import numpy as np
from scipy.optimize import minimize_scalar

from coupling import History
from coupling.pictures import figure

WIDTH, GRAVITY, DENSITY = 0.05715, 9.81, 1000.0  # a, 2.25 inches [m]; [m/s^2]; of water [kg/m^3]
TIMES = 0.0, 0.05, 0.10, 0.15, 0.19  # [s] of the pictures
FRONT = np.array([1.11, 1.22, 1.44, 1.67, 1.89, 2.11, 2.33, 2.56, 2.78, 3.0, 3.22, 3.44, 3.67, 3.89, 4.11])
# T = n t sqrt(g / a) at which the front Z = x / a is at FRONT, by n^2
AT = {1: np.array([0.43, 0.62, 0.80, 0.97, 1.14, 1.29, 1.45, 1.62, 1.76, 1.93, 2.07, 2.24, 2.40, 2.54, 2.71]),
      2: np.array([0.41, 0.84, 1.19, 1.43, 1.63, 1.83, 1.98, 2.20, 2.32, 2.51, 2.65, 2.83, 2.98, 3.11, 3.33])}
FROM = 1.44  # Z from which fronts are compared: before, the gate still opens


def scaled(time: np.ndarray, front: np.ndarray, aspect: int,
           cell: float) -> Tuple[np.ndarray, np.ndarray]:
    """T and Z of a run from ``time`` [s] and ``front`` [m], the largest x of points: one stands for the
    quarter of a ``cell`` [m] beyond it."""
    return time * np.sqrt(aspect * GRAVITY / WIDTH), (front + 0.25 * cell) / WIDTH


def beside(T: np.ndarray, Z: np.ndarray, aspect: int, until: float = 2.5) -> Tuple[float, np.ndarray]:
    """How much later than the run the experiment is, in T, and relative errors of the front then, shape (n,),
    at the times between the front's being at ``FROM`` and T = ``until``. The time at which the gate lets the
    water go is not known: it is the one that makes the largest error smallest."""
    used = (FROM - 1e-9 < FRONT) & (until + 0.02 >= AT[aspect])

    def off(late: float) -> np.ndarray:
        return np.asarray(np.interp(AT[aspect][used] - late, T, Z) / FRONT[used] - 1.0)

    late = minimize_scalar(lambda late: np.abs(off(late)).max(), bounds=(-0.5, 0.5), method="bounded").x
    return float(late), off(late)


def errors(histories: Dict[str, History], aspect: int, cell: float) -> Dict[str, float]:
    """Delay of the gate in T, largest error of the front until T = 2.5 with it, and growth of the volume."""
    history = histories["solid"]
    found = {"volume": history["volume"].max() / (aspect * WIDTH**2) - 1.0}
    T, Z = scaled(history["time"], history["front"], aspect, cell)
    if T[-1] > 2.5:
        late, off = beside(T, Z, aspect)
        found |= {"late": late, "front": np.abs(off).max()}
    return {name: float(value) for name, value in found.items()}


def draw(path: Path, histories: Dict[str, History], aspect: int, cell: float) -> None:
    """Front beside the experiment's, and energies, over the scaled time."""
    history = histories["solid"]
    T, Z = scaled(history["time"], history["front"], aspect, cell)
    late = beside(T, Z, aspect)[0] if T[-1] > 2.5 else 0.0
    front = [(T + late, Z, "run, as late as the gate", "run"),
             (AT[aspect], FRONT, "Martin & Moyce 1952", "reference")]
    energy = [(T + late, history[name], name, "run") for name in ("potential", "kinetic", "elastic")]
    figure.draw(path, "n t (g / a)^(1/2) [-]", {"front x / a [-]": front, "energy [J/m]": energy})
