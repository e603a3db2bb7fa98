"""The figure of a sphere that falls on a bed."""
from pathlib import Path
from typing import Dict

import numpy as np

from coupling import History
from coupling.pictures import figure

MEAN = 0.01  # [s]


def draw(path: Path, histories: Dict[str, History], v0: float, g: float) -> None:
    """Depth, speed and force over time; beside the depth that of a free fall with the speed ``v0`` [m/s]
    under gravity ``g`` [m/s^2]. The force thick: mean over the last ``MEAN`` s, thin: of each window."""
    panels: Dict[str, list] = {"depth [mm]": [], "speed, downward [m/s]": [], "force on the sphere [N]": []}
    styles = ["run"] if len(histories) == 1 else ["under", "run"]
    for (name, history), style in zip(histories.items(), styles):
        t = history["time"]
        mean = figure.mean_over(t, history["window"], history["force"], MEAN)
        shown = 1e3 * history["depth"], history["speed"], mean
        told = name if len(histories) > 1 else "run"
        for curves, values in zip(panels.values(), shown):
            curves.append((t, values, told, style))
        panels["force on the sphere [N]"][-1] = (t, mean, f"{told}, mean of {1e3 * MEAN:.0f} ms", style)
        panels["force on the sphere [N]"].append((t, history["force"], "", "thin"))
    most = max(history["depth"].max() for history in histories.values())
    end = np.linspace(0.0, (np.sqrt(v0**2 + 2.0 * g * most) - v0) / g, 50)
    panels["depth [mm]"].append((end, 1e3 * (v0 * end + 0.5 * g * end**2), "free fall", "reference"))
    figure.draw(path, "time [s]", panels)
