"""The state of an MPM that does not depend on the number of ranks, and files of it."""
import platform
import sys
from importlib.metadata import distributions
from typing import Any, Dict

import numpy as np

import mpm_dem_store as store

from .errors import MPMError
from .grid.numbered import Numbered
from .output.states import OF_RANKS, check_checkpoint, while_open
from .solve import kept
from .stepped import Stepped

KIND, RUN = "MPM", "run"  # of files: of an MPM, and of a coupled run with one
PROJECT = "mpm-dem"


class Restarting(Stepped):
    """A model that can be kept in a file and goes on from there, on the ranks that there are then."""

    @while_open
    def get_checkpoint(self) -> Dict[str, Any]:
        """Everything that decides the future, as a tree for ``mpm_dem_store``: values that are the same on
        every rank, and a ``Table`` of what this rank has of the points and of the grid. MPMError between the
        load steps of ``settle``. Collective."""
        if self._settling is not None:
            raise MPMError("there are no checkpoints between the load steps of settle: save before or after")
        numbered = Numbered(self.background, self._router)
        applied = getattr(self._forces, "applied", None)
        return {"scene": self._fingerprint[OF_RANKS:].copy(), "time": self.time, "steps": self.steps,
                "origin": self.origin.copy(), "ranks": self.comm.size,
                "owner": self.background.owner.copy(), "blocks": self._blocks(),
                "rebalances": np.array(self.rebalances, float).reshape(-1, 3),
                "ladder": self._ladder.get_checkpoint(), "losses": self._losses.get_state(),
                **self._impulses.get_state(), **self._works.get_state(), **self._feeds.get_state(),
                **self._outlets.get_state(), **self._on_bodies.get_state(),
                "interface": self._surface.get_state(), "outflow": self._outflow.get_checkpoint(),
                "applied": applied, "points": self._sets.get_checkpoint(numbered),
                "step": kept.get_checkpoint(self.step, numbered)}

    @while_open
    def set_checkpoint(self, tree: Dict[str, Any]) -> None:
        """Go on from ``tree``, of an MPM of the same scene: on as many ranks as it was made on bit for bit,
        on others to round-off, with the grid distributed for the points as they are. ValueError for another
        scene; where that shows in supports and walls alone, the MPM is then of no more use. Collective."""
        check_checkpoint(tree, self._fingerprint)
        self.time, self.steps = tree["time"], tree["steps"]
        self.rebalances[:] = [(int(step), *ratios) for step, *ratios in tree["rebalances"].tolist()]
        self._ladder.set_checkpoint(tree["ladder"])
        self._losses.set_state(tree["losses"])
        self._impulses.set_state(tree)
        self._works.set_state(tree)
        self._feeds.set_state(tree)
        self._outlets.set_state(tree)
        self._on_bodies.set_state(tree)
        self._surface.set_state(tree["interface"])
        self._outflow.set_checkpoint(tree["outflow"])
        self._forces.applied = tree["applied"]
        self._take_distribution(tree)
        numbered = Numbered(self.background, self._router)
        self._sets.set_checkpoint(tree["points"], numbered)
        self._renew_step(numbered.take_cells(tree["step"]["filled"]))
        kept.set_checkpoint(self.step, tree["step"], numbered)
        self._located = False
        self.move_walls()

    def _take_distribution(self, tree: Dict[str, Any]) -> None:
        """That of the ``tree`` where the number of ranks is the same, else one for its points."""
        owner = tree["owner"] if tree["ranks"] == self.comm.size else None
        if np.array_equal(tree["blocks"], self._blocks()) and (
                self.comm.size == 1 or np.array_equal(owner, self.background.owner)):
            return
        self.step.destroy()
        self._router.free()
        self.step = self._facets = None
        material = [table for name, table in tree["points"].items() if name.startswith("points")]
        self._distribute(np.concatenate([table.fields["x"] for table in material]), owner, tree["blocks"])

    def _blocks(self) -> np.ndarray:
        """Numbers of the blocks of a large grid that are there, which cells are counted in, else empty."""
        blocks = self.background.blocks
        return np.zeros(0, np.int64) if blocks is None else blocks.numbers.copy()

    # ---------------------------------------------------------------- files

    @while_open
    def save(self, path: Any) -> None:
        """Write all that decides the future into the file ``path``, see ``load``. Collective."""
        head = {"kind": KIND, "time": self.time, "ranks": self.comm.size, "versions": versions()}
        store.write(path, self.get_checkpoint(), head, self.comm)

    @while_open
    def load(self, path: Any) -> None:
        """Go on from the file ``path`` of an MPM of the same scene, or of a coupled run with one: on as many
        ranks as it was written on bit for bit, on others to round-off. ValueError for another scene, and for
        a file of something else. Collective."""
        kind = store.read_head(path, self.comm)["kind"]
        if kind not in (KIND, RUN):
            raise ValueError(f"{path} is a checkpoint of kind {kind!r}: give one of an MPM or of a run")
        tree = store.read(path, self.comm)
        self.set_checkpoint(tree["solid"] if kind == RUN else tree)


def versions() -> Dict[str, str]:
    """Of the project, Python and the libraries that compute."""
    loaded = {name: sys.modules[name].__version__ for name in ("numpy", "dolfinx", "petsc4py")
              if name in sys.modules}
    own = next((one.version for one in distributions(name=PROJECT)), "not installed")
    return {PROJECT: own, "python": platform.python_version(), **loaded}
