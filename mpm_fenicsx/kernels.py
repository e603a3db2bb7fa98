"""All kernels of one body, compiled for its dimension, cell, law and kind of inertia."""
from typing import Callable, NamedTuple

from . import laws, shape, transfer, weakform
from .specialise import specialise
from .stress_state import point_functions


class Kernels(NamedTuple):
    """See the module each comes from: ``shape``, ``transfer``, ``weakform``."""

    shapes: Callable
    to_grid: Callable
    to_points: Callable
    spread: Callable
    interpolate: Callable
    only_active: Callable
    residual: Callable
    tangent: Callable
    energies: Callable
    cauchy: Callable


def compile_kernels(body, background, consistent):
    """Kernels for ``body``, with consistent or lumped inertia, on the cells of ``background``."""
    D, K, law = body.dim, background.cells.shape[1], body.law
    size = dict(D=D, K=K)
    to_reference = specialise(shape.reference, **size, AFFINE=background.affine)
    stress, _ = laws.kernels(law, D)
    point_stress, point_tangent = point_functions(law, body.stress_state, D)
    return Kernels(
        shapes=specialise(shape.shapes, **size, to_reference=to_reference),
        to_grid=specialise(transfer.to_grid, **size),
        to_points=specialise(transfer.to_points, **size),
        spread=specialise(transfer.spread, **size),
        interpolate=specialise(transfer.interpolate, **size),
        only_active=specialise(transfer.only_active, K=K),
        residual=specialise(weakform.residual, **size, CONSISTENT=consistent, point_stress=point_stress),
        tangent=specialise(weakform.tangent, **size, CONSISTENT=consistent, point_tangent=point_tangent),
        energies=specialise(weakform.energies, D=D, strain_energy=laws.bound(law, law.energy, D)),
        cauchy=specialise(weakform.cauchy, D=D, stress=stress))
