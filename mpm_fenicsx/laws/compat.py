"""The only file with names of UFL and its form compiler FFCx (those of dolfinx: ``grid.compat``): an energy
becomes C functions.

UFL differentiates psi(F, parameters) by the entries of F that a law has, (F_11, F_12, F_21, F_22, F_33) in
the plane and all nine in space; FFCx writes C for energy, stress and the upper triangle of the tangent; cffi
compiles it, once: what is made stays in the folder of dolfinx' form compiler, where other processes find it.
"""
import contextlib
import logging
import os
import re
import shutil
import sysconfig
import warnings
from inspect import signature
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, NoReturn, Sequence, Tuple

import numpy as np
import ufl
from mpi4py import MPI
from ufl.algorithms.analysis import extract_type
from ufl.constantvalue import ConstantValue
from ufl.core.expr import Expr
from ufl.core.multiindex import MultiIndex
from ufl.corealg.traversal import unique_pre_traversal
from ufl.variable import Label, Variable

import mpm_dem_cache as cache

KINDS = "energy", "stress", "tangent"
# Without errno, which nobody reads, one power of J is computed once; what is not a number stays that. The
# code is not made for this processor alone: ranks of a cluster may share it.
FLAGS = ["-O2", "-g0", "-fno-math-errno"]
WAIT = 60  # for another run that compiles the same energy [s]
# Of the variable by which UFL differentiates: FFCx tells formulas apart by it, so that it must not count how
# many variables there have been before. UFL gives such numbers to no other one.
_ENTRIES = Label(10**9)


class Functions(NamedTuple):
    """C functions of an energy. key: of its formula; addresses: (kind, D) → where the function is."""

    key: str
    addresses: Dict[Tuple[str, int], int]


def _element():
    if hasattr(ufl, "VectorElement"):  # dolfinx 0.5 and 0.6
        return ufl.VectorElement("Lagrange", "interval", 1, dim=1)
    from basix.ufl import element

    return element("Lagrange", "interval", 1, shape=(1,))


def _refuse(name: str, what: str, remedy: str) -> NoReturn:
    raise ValueError(f"{name} {what}: {remedy}")


@contextlib.contextmanager
def _quietly(level: int) -> Iterator[None]:
    """Without what libraries log up to that level, and their warnings: UFL warns of each number that it does
    not know, setuptools tells the command lines of the compiler."""
    before = logging.root.manager.disable
    logging.disable(level)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)


def _called(psi: Callable, name: str, *arguments: Any) -> Any:
    try:
        with _quietly(logging.WARNING):
            found = psi(*arguments)
        found = found if isinstance(found, Expr) else ufl.as_ufl(found)
    except Exception as error:  # of UFL, numpy, or the energy itself
        said = " ".join(str(error).split()) or type(error).__name__
        _refuse(name, f"cannot be read by UFL ({said})", "write it with functions of ufl, as ufl.det(F), "
                "ufl.tr(F.T * F) and ufl.ln(J)")
    return found


def _expressions(psi: Callable, name: str, count: int, D: int) -> List[Any]:
    """W, P and the upper triangle of A, row by row, in ``D`` dimensions, of ``psi`` with ``count``
    parameters. One constant holds all they depend on. W is zero undeformed."""
    n = 5 if D == 2 else 9
    given = ufl.Constant(ufl.Mesh(_element()), shape=(n + count,))
    x = Variable(ufl.as_vector([given[i] for i in range(n)]), _ENTRIES)
    F = ufl.as_matrix([[x[0], x[1], 0], [x[2], x[3], 0], [0, 0, x[4]]] if D == 2 else
                      [[x[3 * i + j] for j in range(3)] for i in range(3)])
    parameters = [given[n + i] for i in range(count)]
    W = _called(psi, name, F, *parameters)
    if W.ufl_shape or W.ufl_free_indices:
        _refuse(name, f"is not a scalar, it has the shape {W.ufl_shape or 'of free indices'}",
                "sum over its entries, as ufl.tr and ufl.inner do")
    known = ConstantValue, MultiIndex, Label
    others = [one for one in extract_type(W, ufl.core.terminal.Terminal)
              if not (isinstance(one, known) or one == given)]
    if others:
        _refuse(name, f"depends on {str(others[0])!r}", "let it depend on F and on parameters, which "
                "from_energy takes by their names")
    if not any(one is x or one == x for one in unique_pre_traversal(W)):
        _refuse(name, "does not depend on F", "let it be a function of the deformation gradient")
    P = ufl.diff(W, x)
    A = ufl.diff(P, x)
    half = ufl.as_vector([A[i, j] for i in range(n) for j in range(i, n)])
    return [W - _called(psi, name, ufl.Identity(3), *parameters), P, half]


def _built(expressions: Sequence[Any], folder: str) -> Any:
    """Compiled expressions and the module that holds them, from the ``folder`` where they are there."""
    from ffcx.codegeneration import jit  # brings the form compiler, which few runs need

    old = "parameters" in signature(jit.compile_expressions).parameters  # until dolfinx 0.6
    options = dict(parameters={"scalar_type": "double"}) if old else dict(options={"scalar_type": np.float64})
    point = np.zeros((1, 1))
    with _quietly(logging.INFO):
        return jit.compile_expressions([(one, point) for one in expressions], cache_dir=folder, timeout=WAIT,
                                       cffi_extra_compile_args=FLAGS, **options)[:2]


def _folder() -> str:
    """Where dolfinx keeps compiled forms, or where we keep kernels when that cannot be written."""
    from dolfinx import jit

    options = getattr(jit, "get_options", None) or jit.get_parameters
    folder = options()["cache_dir"]
    return str(folder if cache.writable(folder) else cache.own_folder() / "fenics")


def _why(error: Exception) -> str:
    """A sentence for what the form compiler has raised."""
    compiler = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()[0]
    said = (" ".join(str(error).split()) or type(error).__name__)[:300]
    if shutil.which(compiler) is None:
        return (f"cannot be compiled, there is no C compiler ({compiler}): install gcc, or name another one "
                "as CC=…")
    if isinstance(error, TimeoutError):
        file = re.search(r"remove (.+?\.c)\)", said)
        return ("is being compiled by another run, or was by one that is gone: wait, or remove "
                f"{file.group(1) if file else said}")
    return (f"cannot be compiled ({said}): look for functions that UFL knows and C does not, and whether gcc "
            "and the headers of Python (python3-dev) are there")


def functions(psi: Callable, name: str, count: int) -> Functions:
    """C functions of the energy ``psi(F, *parameters)``, compiled on rank 0; the other ranks read what it has
    made. name: of the energy in a sentence. ValueError where it is not an energy, RuntimeError where it
    cannot be compiled. Collective."""
    expressions = [one for D in (2, 3) for one in _expressions(psi, name, count, D)]
    comm, made, failed, folder = MPI.COMM_WORLD, None, "", ""
    if comm.rank == 0:
        try:
            folder = _folder()
            made = _built(expressions, folder)
        except Exception as error:  # of setuptools, cffi, FFCx
            failed = _why(error)
    failed, folder = comm.bcast((failed, folder))
    if failed:
        raise RuntimeError(f"{name} {failed}")
    objects, module = made or _built(expressions, folder)
    _loaded.append(module)
    kinds = [(kind, D) for D in (2, 3) for kind in KINDS]
    places = [int(module.ffi.cast("intptr_t", one.tabulate_tensor_float64)) for one in objects]
    return Functions(module.__name__.rpartition("_")[2][:20], dict(zip(kinds, places)))


_loaded: List[Any] = []  # modules, kept as long as kernels may call them
