"""How a scene is computed, apart from what it is: frozen data, checked when made."""
from dataclasses import dataclass
from typing import ClassVar, Dict, Literal, get_args

import mpm_dem_checks as check

Kind = Literal["linear", "gimp", "ugimp", "bspline"]
BASES = get_args(Kind)
Solver = Literal["auto", "direct", "cholesky", "lu", "cg", "gmres", "jacobi", "multigrid", "gamg",
                 "hypre"]
SOLVERS = get_args(Solver)
Transfer = Literal["newmark", "apic", "tpic"]
TRANSFERS = get_args(Transfer)


@dataclass(frozen=True)
class Numerics:
    """Linear solver of a step, how uneven the ranks' shares of the work may be, the basis at the material
    points, the transfers between points and grid, and whether a run starts from rest under its loads.

    >>> Numerics(solver="cg")
    Numerics(solver='cg', rebalance=1.2, basis='linear', transfer='newmark', losses=False,
             settle=0)

    Raises ValueError for a value that is not allowed.
    """

    solver: Solver = "auto"  # of the linear systems, see docs/solvers.md; -mpm_… options win over it
    rebalance: float = 1.2  # imbalance of points over the ranks that calls for a new distribution [-]
    basis: Kind = "linear"  # at the material points, see docs/basis.md; the others need a regular grid
    transfer: Transfer = "newmark"  # between points and grid, and the rule of time; see docs/transfers.md
    losses: bool = False  # book what the transfers lose, in history and report
    settle: int = 0  # load steps to equilibrium without inertia before the first step; 0: none [-]

    may_change: ClassVar[Dict[str, None]] = dict.fromkeys(("solver", "rebalance"))  # where a run is restarted

    def __post_init__(self) -> None:
        check.choice("basis", self.basis, BASES)
        check.choice("solver", self.solver, SOLVERS)
        rule = "an imbalance is never below 1, give a larger number"
        rebalance = check.between("rebalance", self.rebalance, 1, float("inf"), rule=rule)
        object.__setattr__(self, "rebalance", rebalance)
        check.choice("transfer", self.transfer, TRANSFERS)
        check.truth("losses", self.losses)
        if self.transfer == "apic" and self.basis == "linear":
            raise ValueError("transfer is 'apic', which divides by the spread of the basis at a point, and "
                             "that of basis='linear' vanishes at nodes: give basis='bspline' or 'gimp', or "
                             "transfer='tpic'")
        rule = "give a number of load steps, such as 20, or 0 for none"
        object.__setattr__(self, "settle", check.count("settle", self.settle, 0, rule=rule))
