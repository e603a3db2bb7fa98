"""A run of a scene from its start to its end, with all that belongs to it."""
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, Callable, Dict, Iterable, Iterator, List, Optional, Tuple, Union

import numpy as np
from mpi4py import MPI

from . import signals
from .automatic import choose_window, keep_window
from .checkpoint import Checkpoints, Parts, Stopped, contradictions, find, found
from .durations import read_every, seconds
from .hazard.maps import Maps
from .inside import check_apart, check_inside
from .loop.couple import check_end, couple
from .maps.mapping import Mapping, copy, linear, same
from .observing import Observers
from .output import Output
from .records.record import Plan, Record
from .records.schedule import Schedule
from .records.writing import tell
from .scheme import Scheme, Steps
from .started import IMPORTED
from .words import as_texts

ALONE = "solid"  # in the place of a back end's name, where there are no grains


@dataclass(frozen=True)
class Run:
    """A solid, alone or with grains, and how it is run: mapping, loop, history, report, pictures, progress,
    comparison of the back ends, closing. ``go`` runs it.

    name: of the case, in the names of its files; solid: the ``MPM``, at its start; grains: the ``Scene`` of
    the DEM, or None; scheme: ``Scheme``, or ``Steps`` for a solid alone. mapping: of the interface to the
    wall; None for a copy where their nodes coincide, else ``linear``. columns: of the history, name → (unit,
    meaning, function of the ``Window``). observe: function of the two partitions that gives observers of one
    back end's run. errors: function of the histories so far by back end that gives name → number for the
    report; figure: function of path and histories that draws NAME.png. closed: nothing but the two exchanges
    energy, so that a run which gains some is stopped. maps: ``Maps`` of the flow over a terrain.

    An observer is called with each ``Window``. It may have ``begin()``, called before the first one,
    ``columns()``, as above, ``pictures()``: file name → function that draws it at a path, at the end, however
    the run ends, ``due()``: the same of files that are to be written now, ``entries(history)``: more of
    report.json, and ``shapes()``: polygons [m], shape (m, corners, 2), that the animation shows in the place
    of the particles, and, where it remembers something from window to window, ``get_state()`` and
    ``set_state(state)``, plain data for checkpoints. They are made when both sides are at their start, and
    called in their order, before the record is written.

    >>> import tempfile
    >>> from coupling import Output, Run, Steps
    >>> from mpm_fenicsx import MPM, Body, Box, Grid, linear
    >>> body = Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, linear(E=1e6, nu=0.3), rho=1000.0)
    >>> fall = MPM(Grid(Box((-1.0, -1.0), (2.0, 2.0)), (6, 6)), body, gravity=(0.0, -10.0))
    >>> height = {"speed": ("m/s", "of the fall", lambda step: -fall.points.v[0, 1])}
    >>> run = Run("fall", fall, None, Steps(dt=1e-2, t_end=0.1), Output(tempfile.mkdtemp()), columns=height)
    >>> round(run.go()["solid"]["speed"][-1], 6)  # doctest: +ELLIPSIS
    cells of ...
    1.0
    """

    name: str
    solid: Any
    grains: Any
    scheme: Steps
    output: Output
    mapping: Optional[Mapping] = None
    columns: Dict[str, tuple] = field(default_factory=dict)
    observe: Optional[Callable] = None
    errors: Optional[Callable] = None
    figure: Optional[Callable] = None
    closed: bool = False
    maps: Optional[Maps] = None
    _running: List[Checkpoints] = field(default_factory=list, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.grains is not None and not isinstance(self.scheme, Scheme):
            raise ValueError("scheme has no substeps of the DEM: with grains give a Scheme in the place of "
                             "Steps")
        if self.grains is not None:
            object.__setattr__(self, "grains", with_balls(self.grains, self.solid))

    def go(self, parameters: Optional[dict] = None, began: float = IMPORTED) -> dict:
        """Run it; returns the ``History`` of each back end by its name, "solid" for a solid alone.

        parameters: of the report, besides scheme and output; began: moment from which the start-up time
        counts. Raises what the partitions and the loop raise; see ``Record`` for what is left then.
        """
        if self.scheme.dt is None:
            place = self.output.restart
            scheme = keep_window(self.scheme, found(place).head["parameters"]) if place is not None else \
                choose_window(self.scheme, self.solid, self.grains)
            chosen = replace(self, scheme=scheme)
            object.__setattr__(chosen, "_running", self._running)  # it is this run that an observer saves
            return chosen.go(parameters, began)
        histories: dict = {}
        coupled = self.scheme if isinstance(self.scheme, Scheme) and self.grains is not None else None
        back_ends = coupled.back_ends if coupled else (ALONE,)
        place, goes_on = self.output.restart, ""
        if place is not None:
            goes_on = self._check(found(place).head, parameters)
            if len(back_ends) > 1 and place.is_file():
                place = place.parent  # with a checkpoint of each
        for backend in back_ends:
            solid = self.solid.anew() if histories else self.solid
            grains = self.grains.open(backend, coupled.inner) if coupled else None
            label = backend if len(back_ends) > 1 and backend == "liggghts" else ""
            plan = Plan(self.name, self._parameters(parameters), self.output, self.scheme, self.columns, {},
                        label, self.closed, began, goes_on, ground=self.maps and self.maps.terrain)
            with closing(solid, grains):
                why = self._one(plan, place, (backend, solid, grains), histories)
            if why:
                break
            began = perf_counter()
        return histories

    def save(self, path: Union[str, Path]) -> None:
        """Write a checkpoint to ``path`` as soon as the window in progress is recorded; for observers.
        RuntimeError at any other time: at its end a run writes one with ``checkpoint="end"``. Collective."""
        if not self._running:
            raise RuntimeError(f"the run {self.name} is not on its way: save it from an observer, or ask "
                               "for a checkpoint at its end with Output(checkpoint=\"end\")")
        self._running[-1].wanted.append(Path(path))

    def load(self, path: Union[str, Path]) -> "Run":
        """The same run, which goes on from the checkpoint, or the folder of results, at ``path``."""
        return replace(self, output=replace(self.output, restart=Path(path)))

    def _parameters(self, given: Optional[dict]) -> dict:
        """All keys as the run has them: what a case leaves open, as its window, is in the scheme."""
        own = {**asdict(self.scheme), **asdict(self.output)}
        return own if given is None else {name: own.get(name, value) for name, value in given.items()}

    def _check(self, head: dict, parameters: Optional[dict]) -> str:
        """ValueError unless the run may go on from a checkpoint with this ``head``; returns the name of its
        run. Keys of a case have been checked by the case."""
        if head["case"] != self.name:
            raise ValueError(f"restart={self.output.restart} is of {head['case']}, this is {self.name}: give "
                             "a checkpoint of this case")
        if parameters is None:
            contradictions(head["parameters"], as_texts(self._parameters(None)),
                           {**self.scheme.may_change, **self.output.may_change})
        return str(head["run"])

    def _one(self, plan: Plan, place: Optional[Path], sides: Tuple[str, Any, Any], histories: dict) -> str:
        """The run with one back end, from the checkpoint at ``place``, or from its start; returns why it has
        been stopped, or "" at its end. sides: name of the back end, solid, grains."""
        backend, solid, grains = sides
        mapping = None if grains is None else self._mapping(solid)
        observers = Observers(self, solid, grains)
        plan = observers.added_to(plan)
        record = Record(plan, solid, grains)
        parts = Parts(solid, grains, tuple(observers), record)
        saved = find(place, plan.label) if place else None
        last = parts.load(saved, Path(self.output.out)) if saved else None
        if last is not None:
            check_end(self.scheme, solid.time, last)
        with record, self._saving(parts, plan) as checkpoints:
            try:
                with signals.deferred() if self._is_kept else nullcontext():
                    couple(solid, grains, mapping, self.scheme, [*observers, record, checkpoints], last)
            except Stopped as stop:
                return self._stop(record, str(stop), checkpoints.entries())
            histories[backend] = record.history
            observers.take()
            more = observers.entries(record.history)
            if self.output.checkpoint is not None:
                checkpoints.finish()
            more.update(checkpoints.entries())
            record.finish(self.errors(histories) if self.errors else {},
                          partial(self.figure, histories=histories) if self.figure else None, **more)
        return ""

    @property
    def _is_kept(self) -> bool:
        """Whether it writes a checkpoint when it is stopped."""
        return self.output.checkpoint is not None or self.output.walltime is not None

    @contextmanager
    def _saving(self, parts: Parts, plan: Plan) -> Iterator[Checkpoints]:
        """What writes the checkpoints of one back end's run, as long as it lasts."""
        limit = None if self.output.walltime is None else seconds("walltime", self.output.walltime)
        schedule = Schedule(read_every(self.output.checkpoint), limit, IMPORTED)
        head = {"case": self.name, "parameters": as_texts(plan.parameters)}
        self._running.append(Checkpoints(parts, schedule, head, plan.label))
        try:
            yield self._running[-1]
        finally:
            self._running.pop()

    def _stop(self, record: Record, why: str, more: Dict[str, Any]) -> str:
        """The end of a run that goes on later."""
        record.interrupt(why, **more)
        if MPI.COMM_WORLD.rank == 0:
            tell(f"{why}: go on with restart={self.output.out}")
        return why

    def _mapping(self, solid: Any) -> Mapping:
        if self.mapping is not None:
            return self.mapping
        if getattr(solid, "ball_radius", None) is not None:
            return same()
        interface, nodes = solid.interface, self.grains.wall.nodes
        return copy(nodes) if np.array_equal(interface.x, nodes) else linear(interface.x, interface.elements,
                                                                             nodes)


def with_balls(scene: Any, solid: Any) -> Any:
    """The ``scene`` of grains, whose wall gets the radius of balls when the interface of the ``solid`` has
    such and the wall has none."""
    radius = getattr(solid, "ball_radius", None)
    if radius is not None:
        check_inside(scene, solid)
    check_apart(scene, solid)
    if radius is None or scene.wall.radius is not None:
        return scene
    wall = scene.wall
    return replace(scene, wall=replace(wall, elements=np.zeros((0, 1), int), radius=radius))


@contextmanager
def closing(*partitions: Any) -> Iterator[None]:
    """Closes them at the end; after an error, which on several ranks may be one of a single rank, only when
    alone."""
    try:
        yield
    except BaseException:
        if MPI.COMM_WORLD.size == 1:
            _close(partitions)
        raise
    _close(partitions)


def _close(partitions: Iterable) -> None:
    for partition in partitions:
        if partition is not None:
            partition.close()
