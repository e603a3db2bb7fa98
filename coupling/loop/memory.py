"""What the loop goes on from, as plain data: names, numbers and arrays, as a checkpoint holds them."""
from typing import Any, Dict

from .couple import LoopState, Position
from .iterate import IterationState
from .trend import Trend
from .window import Window


def to_tree(window: Window) -> Dict[str, Any]:
    """The last ``window`` with all that goes over to the next one, by field."""
    state = window.state
    scheme = state.scheme._asdict() if isinstance(state.scheme, IterationState) else state.scheme
    trend = None if state.trend is None else state.trend._asdict()
    plain = dict(state._asdict(), trend=trend, scheme=scheme, position=state.position._asdict())
    return dict(window._asdict(), change=None, state=plain)  # no later window asks for the change before it


def from_tree(tree: Dict[str, Any]) -> Window:
    """The counterpart."""
    state = tree["state"]
    trend, scheme = state["trend"], state["scheme"]
    return Window(**dict(tree, state=LoopState(
        trend and Trend(**trend), IterationState(**scheme) if isinstance(scheme, dict) else scheme,
        state["control"], Position(**state["position"]), state["energy"])))
