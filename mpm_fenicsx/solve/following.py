"""The stiffness of loads that follow the surface, for Newton's method in load steps without inertia.

Turning with the surface, a pressure on a slender body changes as much as the body resists, and Newton's
method without that part of the tangent does not converge. It couples nodes of different cells and is not
symmetric, so it stays out of the matrix: GMRES applies it as a difference of the loads, with the factorised
(or else preconditioned) matrix of the bodies, beside which it has low rank."""
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from .options import PREFIX

STEP = 1e-3  # of the difference, largest displacement of a node [cells]


class FollowingTangent:
    """The product of the whole tangent with a vector, see PETSc's matrices of type python."""

    def __init__(self, equations, matrix, h):
        """equations: ``statics.StaticEquations``; matrix: of the active cells; h: size of a cell [m]."""
        self._equations, self._matrix, self._h = equations, matrix, h

    def mult(self, mat, x, y):
        """Matrix times x, less the change of the loads along x, into y."""
        self._matrix.mult(x, y)
        direction = np.array(x.array_r).reshape(self._equations.shape)
        most = mat.comm.tompi4py().allreduce(np.abs(direction).max(initial=0.0), MPI.MAX)
        if most > 0.0:
            step = STEP * self._h / most
            y.array_w[:] -= self._equations.change_of_loads(step * direction).ravel() / step


def use(newton, equations, matrix, h):
    """Have the SNES of ``newton`` solve with the whole tangent; returns its matrix, to be destroyed."""
    size = matrix.getSizes()
    whole = PETSc.Mat().createPython(size, FollowingTangent(equations, matrix, h), comm=matrix.comm)
    whole.setUp()
    newton.snes.setJacobian(newton.tangent_wanted, whole, matrix)
    return whole


def use_gmres(newton):
    """The linear solver that suits it, unless the user has chosen one."""
    if not PETSc.Options(PREFIX).hasName("ksp_type"):
        ksp = newton.snes.getKSP()
        ksp.setType("gmres")
        ksp.setTolerances(rtol=1e-8)
