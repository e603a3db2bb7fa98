"""A case as a script of its own that takes no time to start: a solid alone, a mass that falls."""
import time
from types import SimpleNamespace

import numpy as np

from coupling import Record, cli, march


class Mass(SimpleNamespace):
    """What ``Record`` and ``march`` ask of a solid."""

    time, iterations, count, phases = 0.0, 1, 1, {}

    def surface(self):
        return np.zeros((0, 2)), np.zeros((0, 2))

    def advance(self, dt):
        time.sleep(self.pause)
        self.time += dt
        return self.surface()

    def snapshot(self):
        return {"points": (np.full((1, 2), self.time), {"vertex": [[0]]}, {})}

    def describe(self):
        return {}

    def unused_options(self):
        return []


def main(
    dt: float = 1e-3,  # step [s]
    t_end: float = 0.01,  # end [s]
    pause: float = 0.0,  # run time of a step [s]
    wide: int = 1,  # columns [-]
    paraview: int = 0,  # steps from file to file [-]
    out: str = "out/toy",  # folder
):
    """A mass falls."""
    solid = Mass(pause=pause)
    columns = {f"y{k}": ("m", "height", lambda step: -4.905 * step.time**2) for k in range(wide)}
    with Record("toy", dict(locals()), out, solid, None, windows=round(t_end / dt), columns=columns,
                paraview=paraview) as record:
        march(solid, dt=dt, t_end=t_end, on_window=[record])
        record.finish({})


if __name__ == "__main__":
    cli.run(main)
