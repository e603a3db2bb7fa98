"""Partitioned coupling of a solid (MPM) and grains (DEM): how a scene is run, the loop, the maps, the ledger.
Knows neither solver."""
# isort: off
from . import started  # noqa: F401 - first of all: from here the start-up time counts
import mpm_dem_cache  # noqa: F401 - before anything is compiled
# isort: on

from . import cli
from .cli import case
from .hazard.maps import Gauge, Line, Maps
from .loop.couple import NotConvergedError, Window, couple, march
from .maps.mapping import Mapping, copy, linear, nearest, same
from .maps.spread import indentation_compliance, spread
from .output import Output
from .pictures.flow import FlowPictures
from .records.history import History
from .run import Run
from .scheme import Scheme, Steps, count_windows

__all__ = [  # a scene and how it is run; what it leaves of a flow; maps; the loop by itself and what it tells
    "FlowPictures", "Output", "Run", "Scheme", "Steps", "case", "cli",
    "Gauge", "Line", "Maps",
    "Mapping", "copy", "indentation_compliance", "linear", "nearest", "same", "spread",
    "History", "NotConvergedError", "Window", "count_windows", "couple", "march"]
