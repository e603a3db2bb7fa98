"""All kernels, compiled for dimension, cell and basis; those of a body also for its law and kind of
inertia."""
from typing import Callable, NamedTuple

from mpm_dem_direct import direct

from .. import laws
from ..basis import shape, smooth
from ..compiled import specialise
from ..laws.batches import batch_functions
from ..points import transfer
from . import f_bar, groups, plane_form, stencil_form, weakform


class GridKernels(NamedTuple):
    """For particles of boundaries and walls, whose basis is the linear one; see the module each comes from:
    ``shape``, ``transfer``."""

    shapes: Callable
    to_points: Callable
    spread: Callable
    interpolate: Callable
    only_active: Callable


class PointKernels(NamedTuple):
    """For the material points of all bodies, on their elements, see ``shape`` or ``smooth``, and
    ``transfer``."""

    shapes: Callable
    to_grid: Callable
    to_points: Callable
    spread: Callable
    spread_mass: Callable
    interpolate: Callable
    reaches: Callable


class BodyKernels(NamedTuple):
    """Of one body with its law, see ``weakform``, ``plane_form`` or ``stencil_form``, and ``f_bar``."""

    mean_changes: Callable
    residual: Callable
    add_pressure: Callable
    tangent: Callable
    couple: Callable
    energies: Callable
    cauchy: Callable


def _linear_shapes(background):
    size = dict(D=background.dim, K=background.cells.shape[1])
    if background.affine:
        return specialise(shape.affine_shapes, **size)
    to_reference = specialise(shape.reference, **size, AFFINE=False)
    return specialise(shape.shapes, **size, to_reference=to_reference)


def compile_grid_kernels(background, to_points):
    """Kernels on the cells of ``background``; to_points: template of phase III, see ``transfer``."""
    size = dict(D=background.dim, K=background.cells.shape[1])
    return GridKernels(
        shapes=_linear_shapes(background),
        to_points=specialise(to_points, **size),
        spread=specialise(transfer.spread, **size),
        interpolate=specialise(transfer.interpolate, **size),
        only_active=specialise(transfer.only_active, K=size["K"]))


def compile_point_kernels(background):
    """Kernels on the elements of the material points in ``background``."""
    D, basis = background.dim, background.basis
    size = dict(D=D, K=basis.nodes(D, background.cells.shape[1]))
    shapes = specialise(smooth.shapes, D=D, FOLLOWS=basis.follows) if basis.smooth else _linear_shapes(
        background)
    return PointKernels(
        shapes=shapes,
        to_grid=specialise(transfer.to_grid, **size),
        to_points=specialise(transfer.to_points, **size),
        spread=specialise(transfer.spread, **size),
        spread_mass=specialise(transfer.spread, D=1, K=size["K"]),
        interpolate=specialise(transfer.interpolate, **size),
        reaches=specialise(transfer.reaches, K=size["K"]))


def compile_body_kernels(body, background, consistent):
    """Kernels of the law of ``body``, with consistent or lumped inertia, on the elements of its points."""
    D, law, basis = body.dim, body.law, background.basis
    size = dict(D=D, K=basis.nodes(D, background.cells.shape[1]))
    stress, _ = laws.kernels(law, D)
    batch = batch_functions(law, body.stress_state, D)
    form = dict(**size, CONSISTENT=consistent, FBAR=body.f_bar)
    tangent, couple, patches = stencil_form.tangent, specialise(stencil_form.couple, **size), {}
    if not basis.smooth:
        patches["CELLS_ARE_PATCHES"] = body.f_bar and background.patch is None
        tangent, couple = weakform.tangent, specialise(f_bar.couple, D=D)
    gradients = specialise(groups.deformed_gradients, **size)
    stresses = dict(batch_stress=batch.stress, new_work=batch.work)
    if D == 2 and not (basis.smooth or body.f_bar):
        residual = specialise(plane_form.residual, K=size["K"], NODAL=2 * size["K"] * (0.0,),
                              CONSISTENT=consistent, **stresses)
    else:
        strain, load = (specialise(part, **form, **patches) for part in (groups.strain, groups.load))
        residual = specialise(weakform.residual, **size, FBAR=body.f_bar, strain=strain, load=load,
                              **stresses)
    return BodyKernels(
        mean_changes=direct(specialise(f_bar.mean_changes, **size)),
        residual=direct(residual),
        add_pressure=direct(specialise(f_bar.add_pressure, D=D)),
        tangent=direct(specialise(tangent, **form, **patches, deformed_gradients=gradients,
                                  batch_tangent=batch.tangent,
                                  new_tangent_work=batch.tangent_work)),
        couple=direct(couple),
        energies=direct(specialise(weakform.energies, D=D, strain_energy=laws.bound(law, law.energy, D))),
        cauchy=specialise(weakform.cauchy, D=D, stress=stress))
