"""PETSc's options: those that the user gave changed the run, so the report names them; tolerances must make
sense."""
import math
import warnings

from petsc4py import PETSc

from ..command_line import PETSC_DEFAULTS, words
from ..grid import compat
from . import solvers

PREFIX = "mpm_"
# tolerances of each kind
BELOW_ONE, FINITE = ("snes_rtol", "snes_stol", "ksp_rtol"), ("snes_atol", "ksp_atol")
UNCHECKED = {("snes_type", "ksponly"), ("snes_convergence_test", "skip")}
DECIDE = (*BELOW_ONE, *FINITE, *(name for name, _ in UNCHECKED), "snes_max_it", "snes_force_iteration")
LARGE = 1e-2  # residual over loads and inertia from which a step counts as not solved


def given():
    """Options from the command line, PETSC_OPTIONS, .petscrc and files of options: name (without dash) →
    text."""
    all_of_them = PETSc.Options().getAll()
    return {name: text for name, text in all_of_them.items()
            if text != PETSC_DEFAULTS.get(name) and not solvers.is_preset(name, text, all_of_them)}


def used():
    """Of those given, the ones that somebody asked for, as they are typed."""
    return {f"-{name}": text for name, text in given().items() if compat.option_used(name)}


def unused():
    """Options on the command line, and options of ours given elsewhere, that nobody asked for."""
    typed = [word[1:] for word in words()[1:] if word.startswith("-") and not word[1:2].isdigit()]
    ours = [name for name in given() if name.startswith(PREFIX)]
    return ["-" + name for name in dict.fromkeys(typed + ours) if not compat.option_used(name)]


def check():
    """ValueError for a tolerance that is no number or accepts everything; a warning for solvers that ask no
    tolerance."""
    options = PETSc.Options(PREFIX)
    for name in (*BELOW_ONE, *FINITE):
        if options.hasName(name):
            _check_tolerance(name, options.getString(name))
    for name, value in UNCHECKED:
        if options.getString(name, "") == value:
            warnings.warn(f"-{PREFIX}{name} {value}: no step is checked, its residual may be anything",
                          stacklevel=2)


def _check_tolerance(name, text):
    try:
        value = math.nan if "_" in text else float(text)
    except ValueError:
        value = math.nan
    top, rule = (1.0, "at least 0 and below 1") if name in BELOW_ONE else (math.inf,
                                                                           "that is finite and at least 0")
    if not 0.0 <= value < top:
        accepts = ", which accepts everything" if value >= top else ""
        raise ValueError(f"-{PREFIX}{name} is {text or 'without a value'}{accepts}: give a number {rule}, or "
                         "leave the option out")


class Doubt:
    """Watches the steps of a scene whose user decides when a step is solved."""

    def __init__(self):
        self._told = False
        self._names = tuple(name for name in DECIDE if PETSc.Options(PREFIX).hasName(name))

    def __call__(self, residual, forces, when):
        """One warning when a step is accepted with a ``residual`` that is much of the ``forces``, loads and
        inertia [N]."""
        if self._names and residual > LARGE * forces and not self._told:
            self._told = True
            names = ", ".join(f"-{PREFIX}{name}" for name in self._names)
            warnings.warn(f"{when} was accepted with a residual of {residual:.3g} N, {residual / forces:.1e} "
                          f"of loads and inertia, {forces:.3g} N: the step is not solved, correct {names}",
                          stacklevel=2)
