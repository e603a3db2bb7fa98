"""The observers of a run: those of its case, those that make pictures and maps, and what they add to it."""
from typing import Any, Dict, List

from .ledger.deepest import DepthWatch, watches_depth
from .pictures.views import Animation, EndPicture
from .records.record import Plan
from .records.results import labelled


class Observers(List[Any]):
    """Of a ``Run``, with the partitions at their start, in the order in which they are called. Collective."""

    def __init__(self, run: Any, solid: Any, grains: Any) -> None:
        super().__init__(run.observe(solid, grains) if run.observe else [])
        output, name = run.output, run.name
        if output.picture:
            self.append(EndPicture(name, output.picture, solid, grains, output.view))
        if output.animation:
            shapes = next((one.shapes for one in self if hasattr(one, "shapes")), None)
            self.append(Animation(name, output.animation, solid, grains, shapes, output.view))
        if run.maps is not None:
            from .hazard.watch import MapWatch  # numba takes time, and few runs make maps

            self.append(MapWatch(run.maps, solid, grains))
        if watches_depth(solid, grains):
            self.append(DepthWatch(solid, grains))

    def added_to(self, plan: Plan) -> Plan:
        """The ``plan`` with their columns, their pictures and the files that they write on the way."""
        columns, pictures = dict(plan.columns), dict(plan.pictures)
        for one in self:
            columns.update(getattr(one, "columns", dict)())
            pictures.update({labelled(name, plan.label): draw for name, draw in getattr(
                one, "pictures", dict)().items()})
        return plan._replace(columns=columns, pictures=pictures,
                             due=tuple(one.due for one in self if hasattr(one, "due")))

    def take(self) -> None:
        """The run has come to its end."""
        for one in self:
            if isinstance(one, EndPicture):
                one.take()

    def entries(self, history: Any) -> Dict[str, Any]:
        """Of report.json."""
        more: Dict[str, Any] = {}
        for one in self:
            more.update(getattr(one, "entries", lambda history: {})(history))
        return more
