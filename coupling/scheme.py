"""When a run takes its steps, and how its two sides are coupled: frozen data, whose fields are keys of every
case."""
from dataclasses import dataclass
from typing import Any, ClassVar, Dict, Literal, Optional

import mpm_dem_checks as check

MOST_WINDOWS = 1e9  # of a run: at a millisecond each they take eleven days
WORK_PER_PARTICLE = 1000  # operations in a DEM step, measured


def count_windows(t_end: float, dt: float, substeps: int = 1, start: float = 0.0) -> int:
    """Number of windows from ``start`` [s] on; ValueError unless dt > 0 divides the time and substeps is at
    least 1.

    >>> count_windows(t_end=0.5, dt=1e-3, substeps=20)
    500
    """
    check.count("substeps", substeps)
    work = substeps * WORK_PER_PARTICLE
    check.check_work(f"{substeps:g} DEM steps per window (substeps)", work, "take fewer")
    check.positive("dt", dt, "s", "the window must be positive")
    if not check.finite("t_end", t_end, "s", "it must be finite and lie after the start") > start:
        raise ValueError(f"t_end is {t_end} s: it must lie after the start at {start} s")
    if (t_end - start) / dt > MOST_WINDOWS:
        raise ValueError(f"dt is {dt} s: that makes {(t_end - start) / dt:.3g} windows until {t_end} s, more "
                         f"than {MOST_WINDOWS:g}, take a longer one or a smaller t_end")
    count = round((t_end - start) / dt)
    if count < 1 or abs(start + count * dt - t_end) > 1e-9 * t_end:
        raise ValueError(f"t_end is {t_end} s, which is not a multiple of dt = {dt} s: take t_end="
                         f"{start + max(count, 1) * dt:.10g}")
    return count


def _automatic(keys: dict) -> bool:
    return keys["dt"] is None


@dataclass(frozen=True)
class Steps:
    """Time steps of a solid alone. ValueError unless ``dt`` divides the time. With dt=None a ``Run`` chooses
    it, see ``automatic``.

    >>> Steps(dt=1e-3, t_end=0.5).windows
    500
    """

    dt: Optional[float]  # time step [s]; none: what courant and waves bear
    t_end: float  # end of the run [s]
    adapt: Optional[float] = 0.0  # shorter windows; none: never, 0: where one fails, 0.01: for that error [-]
    courant: Optional[float] = None  # cells a point may cross per step [-]; none: any, with dt=none a half
    speed: Optional[float] = None  # largest that is expected, for dt=none [m/s]; none: of the deepest fall
    waves: Optional[float] = None  # cells an elastic wave may cross per step, for dt=none [-]; none: any

    substeps: ClassVar[int] = 1
    counts: ClassVar[dict] = {name: (_automatic, "where the window is chosen, dt=none")
                              for name in ("speed", "waves")}
    may_change: ClassVar[Dict[str, Any]] = dict.fromkeys(("dt", "t_end", "adapt", "courant"))  # at a restart

    def __post_init__(self) -> None:
        for name in ("courant", "speed", "waves"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check.positive(name, getattr(self, name)))
        if self.dt is not None:
            count_windows(self.t_end, self.dt, self.substeps)

    @property
    def window(self) -> float:
        """The longest one [s]. ValueError while it is not chosen."""
        if self.dt is None:
            raise ValueError("dt is none, and only a Run chooses the window: give a dt [s]")
        return self.dt

    @property
    def windows(self) -> int:
        """Number of windows of full length."""
        return count_windows(self.t_end, self.window, self.substeps)


def _repeats(keys: dict) -> bool:
    return keys["iterate"] != 0


def _keeps_inner_step(old: Dict[str, str], new: Dict[str, str]) -> str:
    if new.get("dt") == "none":  # that of the checkpoint is taken
        return ""
    before, now = (float(keys["dt"]) / int(keys["substeps"]) for keys in (old, {**old, **new}))
    step = f"the step of the DEM, dt/substeps, must stay {before:.10g} s, and would be {now:.10g} s"
    return "" if before == now else step


def _keeps_kind(old: Dict[str, str], new: Dict[str, str]) -> str:
    return "" if old["iterate"] != "0" != new["iterate"] else "windows stay weak, or stay iterated"


@dataclass(frozen=True)
class Scheme(Steps):
    """Windows of a solid and grains, see ``couple``, and the back end of the grains. ``counts``: of a key,
    when it has an effect, see ``case``.

    >>> scheme = Scheme(dt=1e-3, t_end=0.5, substeps=20)
    >>> scheme.windows, scheme.inner, scheme.back_ends
    (500, 5e-05, ('reference',))
    """

    dt: Optional[float]  # window, MPM step [s]; none: what contacts and motion bear
    substeps: int = 1  # DEM steps per window [-]
    iterate: int = 0  # most repetitions of a window until both sides agree [-]; 0: weak coupling
    tol: float = 1e-4  # how well they agree, as a part of the force [-]
    relax: Literal["aitken", "constant", "iqn"] = "aitken"  # how the force is corrected in a repetition
    dem: Literal["reference", "liggghts", "compare"] = "reference"  # back end; compare runs both

    counts: ClassVar[dict] = {**Steps.counts, **dict.fromkeys(
        ("tol", "relax"), (_repeats, "where windows are repeated, iterate=20"))}
    may_change: ClassVar[Dict[str, Any]] = {  # at a restart, and where not always, the rule
        "t_end": None, "adapt": None, "tol": None, "courant": None, "dt": _keeps_inner_step,
        "substeps": _keeps_inner_step, "iterate": _keeps_kind}

    @property
    def inner(self) -> float:
        """Time step of the DEM [s]."""
        return self.window / self.substeps

    @property
    def back_ends(self) -> tuple:
        """Names of those that run, one after the other."""
        return ("liggghts", "reference") if self.dem == "compare" else (self.dem,)
