"""Flow through a plane as a function of time, and how far it has come."""
from typing import Any, Callable, Tuple, Union

import numpy as np

import mpm_dem_checks as check
from mpm_dem_series import is_table, read_table

SAMPLES = 2000  # into which the time of a hydrograph is divided; between them it is linear
EVER = check.MOST  # time [s] of what does not end

Series = Union[float, Callable[[float], float], Tuple[Any, Any], np.ndarray]


class Hydrograph:
    """``speed`` [m/s] and ``discharge`` [m^3/s] at ``times`` [s], shape (n,) each, linear between them and
    zero afterwards. ``travel`` [m] and ``volume`` [m^3]: what has gone through until then.

    >>> rising = Hydrograph(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 2.0]), np.array([0.0, 1.0, 1.0]))
    >>> rising.travelled(2.0), rising.discharged(5.0), rising.when(3.0)
    (3.0, 2.5, 2.0)
    """

    def __init__(self, times: np.ndarray, speed: np.ndarray, discharge: np.ndarray) -> None:
        self.times, self.speed, self.discharge = times, speed, discharge
        self.travel, self.volume = (np.concatenate([[0.0], np.cumsum(0.5 * np.diff(times) * (
            rate[1:] + rate[:-1]))]) for rate in (speed, discharge))

    def travelled(self, time: float) -> float:
        """How far the flow has come since the start [m]."""
        return self._sum(self.speed, self.travel, time)

    def discharged(self, time: float) -> float:
        """Volume since the start [m^3]."""
        return self._sum(self.discharge, self.volume, time)

    def _sum(self, rate: np.ndarray, sums: np.ndarray, time: float) -> float:
        if time >= self.times[-1]:
            return float(sums[-1])
        k = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        past = time - self.times[k]
        slope = (rate[k + 1] - rate[k]) / (self.times[k + 1] - self.times[k])
        return float(sums[k] + past * (rate[k] + 0.5 * slope * past))

    def acceleration(self, time: float) -> float:
        """Of the flow [m/s^2]; zero at the end."""
        if time >= self.times[-1]:
            return 0.0
        k = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        return float((self.speed[k + 1] - self.speed[k]) / (self.times[k + 1] - self.times[k]))

    def when(self, travel: float) -> float:
        """First time at which the flow has come that far [s]."""
        k = int(np.clip(np.searchsorted(self.travel, travel) - 1, 0, len(self.times) - 2))
        left, v = max(travel - self.travel[k], 0.0), self.speed[k]
        slope = (self.speed[k + 1] - v) / (self.times[k + 1] - self.times[k])
        root = np.sqrt(max(v * v + 2.0 * slope * left, 0.0))
        return float(min(self.times[k] + (2.0 * left / (v + root) if left > 0.0 else 0.0), self.times[k + 1]))


def sample(name: str, given: Series, times: np.ndarray, unit: str) -> np.ndarray:
    """Values of a number, function or table at the ``times`` [s], shape (n,), none of them negative."""
    if callable(given):
        found = np.array([float(check.values(name, given, (float(t),), (), unit=unit)) for t in times])
    elif is_table(given):
        found = np.interp(times, *read_table(name, given, unit, ("n",)))
    else:
        found = np.full(len(times), check.finite(name, given, unit))
    if (found < 0.0).any():
        t = times[int(np.argmin(found))]
        raise ValueError(f"{name} is {found.min():.6g} {unit} at t = {t:.6g} s: what flows in is 0 or "
                         "positive, turn the normal for another direction")
    return found
