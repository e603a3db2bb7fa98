"""Partitioned coupling of a solid (MPM) and grains (DEM): the loop, the maps, the books. Knows neither solver."""
from time import perf_counter

STARTED = perf_counter()  # the report's start-up time runs from here

import mpm_dem_cache  # noqa: E402, F401 - before anything is compiled

from .loop.couple import NotConverged, Window, count_windows, couple  # noqa: E402
from .loop.march import march  # noqa: E402
from .maps.mapping import Mapping, linear, nearest  # noqa: E402
from .maps.spread import spread  # noqa: E402
from .records.history import History  # noqa: E402
from .records.record import Record  # noqa: E402

__all__ = ["History", "Mapping", "NotConverged", "Record", "STARTED", "Window", "count_windows", "couple", "linear",
           "march", "nearest", "spread"]
