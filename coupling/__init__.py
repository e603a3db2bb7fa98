"""Partitioned coupling of a solid (MPM) and grains (DEM): how a scene is run, the loop, the maps, the ledger. Knows neither
solver."""
from . import started  # isort: split # noqa: F401 - first of all: from here the start-up time counts

import mpm_dem_cache  # noqa: E402, F401 - before anything is compiled

from . import cli  # noqa: E402
from .cli import case  # noqa: E402
from .loop.control import count_windows  # noqa: E402
from .loop.couple import NotConvergedError, Window, couple, march  # noqa: E402
from .maps.mapping import Mapping, copy, linear, nearest  # noqa: E402
from .maps.spread import spread  # noqa: E402
from .output import Output  # noqa: E402
from .pictures.flow import FlowPictures  # noqa: E402
from .records.history import History  # noqa: E402
from .records.record import Record  # noqa: E402
from .run import Run  # noqa: E402
from .scheme import Scheme, Steps  # noqa: E402

__all__ = ["FlowPictures", "History", "Mapping", "NotConvergedError", "Output", "Record", "Run", "Scheme",
           "Steps", "Window", "case", "cli", "copy", "count_windows", "couple", "linear", "march", "nearest",
           "spread"]
