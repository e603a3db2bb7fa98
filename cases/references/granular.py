"""The granular column of Singer et al. 2022, third example: numbers of the paper, what comes out beside it,
figure."""
import math
from pathlib import Path
from typing import Dict, Sequence, Union

import numpy as np

from coupling import History, cli
from coupling.pictures import figure
from mpm_fenicsx import Body, Soil

SOIL = Soil(E=50e3, nu=0.4, rho=1300.0, phi=22.0)  # table 1 of the paper
GRAVITY = 9.81  # [m/s^2]
SIZE = 0.10, 0.20  # of the column [m]
TIMES = 0.0, 0.10, 0.25, 0.30, 0.36, 0.40, 0.45  # [s] of the pictures, from the third on those of the paper
ARRIVAL = 0.30, 0.25  # the flow is there [m] at that time [s]


def floor_kind(text: str) -> Union[str, float]:
    """``stick``, ``slip`` or the number that the text is; ValueError for another one."""
    try:
        return text if text in ("stick", "slip") else cli.convert("floor", text, float)
    except cli.UsageError:
        raise ValueError(f"floor is {text!r}: give stick, slip or a coefficient of friction") from None


def errors(history: History, bodies: Sequence[Body], gravity: float) -> dict:
    """Largest rise of the energy from step to step and growth of the volume, with and without the gaps,
    relative to the start; largest speed over that of free fall from the top; arrival of the 99 % quantile at
    x = 30 cm after the paper's 0.25 s, relative. bodies: boxes that are the column, in layers from its top
    down; with a stress or a checkpoint at the start its energy is that of the first row."""
    boxes = [body.box for body in bodies]
    width, height = boxes[0].upper[:2]
    volume = float(sum(np.prod(box.size) for box in boxes))
    start = float(sum(body.rho * gravity * np.prod(box.size) * 0.5 * (box.lower[1] + box.upper[1])
                      for body, box in zip(bodies, boxes)))
    if bodies[0].stress is not None or bodies[0].start is not None:
        start = history["energy"][0]
    energy = np.concatenate([[start], history["energy"]])
    found = {"energy_rise": np.diff(energy).max() / start, "volume": history["volume"].max() / volume - 1.0,
             "soil": (history["volume"] - history["gaps"]).max() / volume - 1.0,
             "speed": history["speed"].max() / math.sqrt(2 * gravity * height)}
    place, time = ARRIVAL
    there = history["x99"] >= place
    if (width, height) == SIZE and there.any():
        found["arrival"] = history["time"][np.argmax(there)] / time - 1.0
    return {name: float(error) for name, error in found.items()}


def draw(path: Path, histories: Dict[str, History]) -> None:
    """Front and energies over time."""
    history = histories["solid"]
    t = history["time"]
    front = [(t, 100 * history[name], text, "run") for name, text in (
        ("front", "largest x"), ("x99", "99 % quantile of x"), ("height", "largest height"))]
    energy = [(t, history[name], name, "run") for name in ("potential", "kinetic", "elastic")]
    energy.append((t, history["energy"], "sum", "reference"))
    figure.draw(path, "time [s]", {"front and top [cm]": front, "energy [J]": energy})
