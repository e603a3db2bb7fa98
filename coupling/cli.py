"""A case as a function of typed keys, for the command line (``dt=1e-6``) and for Python. Words with a dash
are PETSc's."""
import atexit
import functools
import inspect
import signal
import sys
import time
import traceback
import typing
import warnings
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

from . import signals, words
from .checkpoint import contradictions, found
from .keys import REQUIRED, Key, keys_of, refuse_without_effect
from .origin import in_program, with_line
from .records.writing import silence, tell
from .run import Run
from .signals import SIGNALS
from .started import IMPORTED
from .words import UsageError, checked, convert, once, typed

__all__ = ["Case", "EXPECTED", "SIGNALS", "UsageError", "case", "checked", "convert", "described", "manual",
           "once", "parse", "run", "typed"]

# anything else is a bug
EXPECTED = (ValueError, RuntimeError, ImportError, ArithmeticError, OSError, MemoryError)
PATIENCE = 5.0  # [s] for ranks that share an error to arrive at their end
IMPATIENT = 0.5  # [s] after an interrupt: mpirun kills the ranks a second after it has told them


class Case:
    """The function ``main`` with its keys, see ``case``. ``keys``: name → ``Key``."""

    def __init__(self, main: typing.Callable, presets: typing.Optional[dict] = None,
                 counts: typing.Optional[dict] = None) -> None:
        functools.update_wrapper(self, main)
        self._main, self.presets = main, presets or {}
        self.script = getattr(getattr(main, "__code__", None), "co_filename", "")
        self.keys, self._classes = keys_of(main)
        self._counts = dict(counts or {})
        self._may_change: typing.Dict[str, typing.Any] = {}
        for kind in self._classes.values():
            self._counts.update(getattr(kind, "counts", {}))
            self._may_change.update(getattr(kind, "may_change", {}))
        required = sorted(self.keys, key=lambda name: self.keys[name].default is not REQUIRED)
        self.__signature__ = inspect.Signature([
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=self.keys[name].default,
                              annotation=self.keys[name].kind) for name in required])
        for name in {*self._counts, *(key for preset in self.presets.values()
                                      for key in preset)} - set(self.keys):
            raise TypeError(f"{main.__name__} has no key {name}")

    def __call__(self, **given: typing.Any) -> typing.Any:
        """Run the case with these keys; returns the histories by back end."""
        return self.start(given, perf_counter())

    def run(self) -> None:
        """Run it with the words of the command line: the script's last line, see ``cli.run``."""
        run(self)

    def start(self, given: dict, began: float) -> typing.Any:
        """Run the case; began: the moment from which its start-up time counts."""
        for name in given:
            if name not in self.keys:
                raise TypeError(f"{self._main.__name__} has no key {name}: it has {', '.join(self.keys)}")
        if given.get("restart") is not None:
            given = self._restarted(given)
        values = {name: given.get(name, key.default) for name, key in self.keys.items()}
        for name, value in values.items():
            if value is REQUIRED:
                raise UsageError(f"{name}= is missing: {self.keys[name].meaning or 'it has no default'}")
        refuse_without_effect(values, self.keys, self._counts)
        result = self._main(**self._arguments(values))
        return result.go(values, began) if isinstance(result, Run) else result

    def _restarted(self, given: dict) -> dict:
        """Keys of a run that goes on from ``given["restart"]``: those of its checkpoint, where they are not
        given. ValueError for a key that contradicts it."""
        saved = found(Path(given["restart"]))
        old = {name: text for name, text in saved.head["parameters"].items() if name in self.keys}
        contradictions(old, words.as_texts(given), self._may_change)
        try:
            kept = {name: words.convert(name, text, self.keys[name].kind) for name, text in old.items()
                    if name != "restart"}
        except UsageError as problem:
            raise ValueError(f"restart={given['restart']} is of {saved.head['case']}, whose keys are others "
                             f"({problem}): give a checkpoint of this case") from None
        return {**kept, "out": saved.path.parent, **given}

    def _arguments(self, values: dict) -> dict:
        """Those of ``main``: keys of its own, and dataclasses of theirs."""
        arguments: dict = {}
        fields: typing.Dict[str, dict] = {name: {} for name in self._classes}
        for name, key in self.keys.items():
            fields.get(key.argument, arguments)[name] = values[name]
        return {**arguments, **{name: self._classes[name](**given) for name, given in fields.items()}}


def case(main: typing.Optional[typing.Callable] = None, *, presets: typing.Optional[dict] = None,
         counts: typing.Optional[dict] = None) -> typing.Any:
    """Decorator: a function of typed arguments becomes a case, whose keys are its arguments and, in the place
    of an argument that is a dataclass, the fields of that. The comment behind each is its meaning in
    ``--help``.

    When the function returns a ``Run``, that is run, and the keys become the parameters of its report.
    presets: name → keys, for ``preset=NAME``; counts: key → (function of all keys that tells whether it has
    an effect, when it has one): where it has none, another value than its default is refused.

    >>> from coupling import Steps, case
    >>> @case(counts={"tip": (lambda keys: keys["load"] > 0, "with load=")})
    ... def main(load: float = 0.0, tip: float = 1.0, steps: Steps = Steps(dt=1e-3, t_end=0.1)):
    ...     return load, steps.windows
    >>> main(load=2.0, dt=1e-2)
    (2.0, 10)
    >>> main(tip=3.0)
    Traceback (most recent call last):
    ValueError: tip=3 has no effect here, it counts with load=: leave it out
    """
    if main is None:
        return functools.partial(case, presets=presets, counts=counts)
    return Case(main, presets, counts)


def as_case(main: typing.Callable) -> Case:
    """A function as a case; a case as it is."""
    return main if isinstance(main, Case) else Case(main)


def run(main: typing.Callable) -> None:
    """Call ``main``, a case or a function, with the words of the command line; the script's last line.

    An error ends the run on all ranks with one sentence on rank 0 and exit status 1 (2 for a wrong command
    line); warnings are one line. Signals end it like an interrupt, see ``signals``: the ranks get one when
    mpirun is interrupted or a queue's time is over.
    """
    this, given = as_case(main), sys.argv[1:]
    warnings.showwarning = _show
    if "--help" in given or "-h" in given:
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python has it, before PETSc puts in its own
        if MPI.COMM_WORLD.rank == 0:
            tell(manual(this))
        return
    with signals.like_interrupts():
        _run(this, given)


def _run(main: Case, given: typing.Sequence[str]) -> None:
    try:
        main.start(parse(main, given), IMPORTED)
    except UsageError as error:
        _stop(with_line(error, main.script), 2)
    except EXPECTED as error:
        _stop(with_line(error, main.script), 1)
    except KeyboardInterrupt:
        signals.ignore()  # a second one must not cut the end short
        atexit.register(signals.ignore)  # nor that of the interpreter, where handlers are those of before
        _stop("interrupted; what was written so far is complete up to the last window", 130, IMPATIENT)
    except Exception as error:
        tell(traceback.format_exc(), sys.stderr)
        _stop("this is a bug in the program: please report the lines above" if in_program(error, main.script)
              else f"{type(error).__name__}: {with_line(error, main.script)}", 1)


def _show(message: typing.Any, category: typing.Any, filename: str, lineno: int, file: typing.Any = None,
          line: typing.Optional[str] = None) -> None:
    if MPI.COMM_WORLD.rank == 0:
        tell(f"warning: {message}", sys.stderr)


def _stop(message: object, status: int, patience: typing.Optional[float] = None) -> None:
    """End all ranks; those that do not share the error wait somewhere for this one and are aborted after
    ``patience``."""
    comm, sentence = MPI.COMM_WORLD, " ".join(str(message).split())
    try:
        sys.stdout.flush()
    except OSError:
        silence(sys.stdout)
    if comm.rank == 0:
        tell(f"error: {sentence}", sys.stderr)
    if comm.size > 1 and not _all_arrive(comm, PATIENCE if patience is None else patience):
        if comm.rank > 0:
            tell(f"error on rank {comm.rank}: {sentence}", sys.stderr)
        comm.Abort(status)
    sys.exit(status)


def _all_arrive(comm: MPI.Comm, patience: float) -> bool:
    request, end = comm.Ibarrier(), time.monotonic() + patience
    while not request.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def parse(main: typing.Callable, given: typing.Sequence[str]) -> dict:
    """Keys of the case ``main`` from words such as ``dt=1e-6``, see ``words.parse``."""
    this = as_case(main)
    return words.parse(given, {name: key.kind for name, key in this.keys.items()}, this.presets)


def manual(main: typing.Callable) -> str:
    """The case's manual: its docstring, and each key with default, meaning and choices."""
    this = as_case(main)
    lines = [inspect.getdoc(this) or "", "", "keys (key=value), with defaults:"]
    lines += [_line(name, key) for name, key in this.keys.items()]
    for name, values in this.presets.items():
        lines.append(f"  {f'preset={name}':26} " + " ".join(f"{k}={typed(v)}" for k, v in values.items()))
    lines += ["", "Options with a dash belong to PETSc: -mpm_snes_monitor, -mpm_snes_rtol 1e-8, -mpm_pc_type "
              "lu, …"]
    return "\n".join(lines)


def described(key: Key) -> typing.Tuple[str, str]:
    """What a manual says of a key: its default, as a word of the command line, and its meaning with the
    choices."""
    kind, meaning = key.kind, key.meaning
    kind = typing.get_args(kind)[0] if typing.get_origin(kind) is typing.Union else kind
    if typing.get_origin(kind) is typing.Literal:
        meaning += f"; one of {', '.join(map(str, typing.get_args(kind)))}"
    return typed(key.default) if key.default is not REQUIRED else "…", meaning


def _line(name: str, key: Key) -> str:
    """One key of the manual."""
    default, meaning = described(key)
    return f"  {f'{name}={default}':26} {meaning}"
