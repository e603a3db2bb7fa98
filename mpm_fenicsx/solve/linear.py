"""The linear solver of one SNES: the preset that is chosen for its tangents, and what takes its place where
that fails."""
from petsc4py import PETSc

from ..errors import MPMError
from . import divergence, solvers
from .options import PREFIX


class LinearSolver:
    """The solver of an ``snes``, which has its matrix, for tangents of ``equations`` as the policy
    ``tangents`` has them. ``preset``: the name of what is chosen, "" until there is a tangent to choose it
    for; ``bears_any_sign``: whether another one may take its place where it fails. Collective."""

    def __init__(self, snes, equations, tangents, nodes, symmetric=True, solver="auto"):
        """nodes: ``coarse_grids.Nodes``; symmetric: so is the tangent; solver: one of ``solvers.SOLVERS``
        that suits it, see ``solvers.check``."""
        self._snes, self._equations, self._tangents, self._nodes = snes, equations, tangents, nodes
        self._symmetric, self._solver, self.preset = symmetric, solver, ""
        given = PETSc.Options(PREFIX).hasName("pc_type")
        self.bears_any_sign = not given and solver not in solvers.POSITIVE
        self._any_sign, self._rescue = False, ""  # rescue: preset of what may do where "auto" has failed

    def choose(self):
        """Defaults for the tangent that is in the matrix, then the user's options. Called again, "auto" keeps
        what it has chosen while that suits a tangent half or twice as stiff."""
        name, tangents = self._solver, self._tangents
        if name == "auto":
            matrix, plastic = self._snes.getKSP().getOperators()[1], tangents.plastic
            system = solvers.System(matrix.getSize()[0], self._nodes.background.dim, self._symmetric,
                                    tangents.by_user or plastic, solvers.is_wide(matrix),
                                    plastic and self._equations.lumped, self._nodes.regular)
            stiffness = tangents.now.stiffness_over_inertia
            name = solvers.automatic(system, stiffness, self.preset)
            self._rescue = solvers.rescue(system, stiffness, name)
        if self.preset != name:
            self.preset = name
            self._configure(self._snes)

    def choose_again(self, preset):
        """The ``preset`` that had been chosen in a state to go back to; "": it is to be chosen yet."""
        preset = self._solver if preset and self._solver != "auto" else preset
        before, self.preset = self.preset, preset
        if preset and preset != before:
            self._configure(self._snes)

    def forget_factors(self):
        """The preconditioner is made anew: it may keep more of earlier matrices, as multigrid does."""
        if self.preset:
            self._snes.getKSP().getPC().setType("none")
            self._configure(self._snes.getKSP())

    def bear_any_sign(self):
        """From now on a solver that bears tangents that are not positive and systems on which iterations
        stall: one of small systems that "auto" chose factorises, others are LU for Cholesky and GMRES for
        conjugate gradients. Returns what it is in words, "" where there is none."""
        if self._any_sign or not (self.bears_any_sign and (self._symmetric or self._rescue)):
            return ""
        self._exchange(True)
        return divergence.FACTOR if self._rescue else divergence.ANY_SIGN

    def as_chosen(self):
        """From now on that which was chosen."""
        if self._any_sign:
            self._exchange(False)

    def _exchange(self, any_sign):
        self._any_sign = any_sign
        self._configure(self._snes.getKSP())
        self._tangents.drop()  # its factor goes, too

    def _configure(self, for_options):
        """The solver that is to be; what ``for_options`` (the SNES or its KSP) are told by the user's options
        comes after that."""
        preset = self._any_sign and self._rescue or self.preset
        try:
            solvers.configure(self._snes.getKSP(), PREFIX, preset, self._nodes,
                              self._symmetric and not self._any_sign, self._tangents.plastic)
            for_options.setFromOptions()
        except PETSc.Error as error:
            raise MPMError(f"PETSc cannot take the options -{PREFIX}… ({divergence.first_line(error)}): "
                           "correct them") from None

    def describe(self):
        """In a few words, for the report."""
        ksp = self._snes.getKSP()
        return f"{solvers.describe(ksp)}, {ksp.getOperators()[1].getSize()[0]} unknowns"
