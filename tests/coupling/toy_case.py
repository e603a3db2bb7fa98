"""A case as a script of its own that takes no time to start: a solid alone, a mass that falls."""
import time
from types import SimpleNamespace

import numpy as np

from coupling import Output, Run, Steps, case


class Mass(SimpleNamespace):
    """What ``Run`` asks of a solid."""

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

    def close(self):
        pass


@case
def main(
    pause: float = 0.0,  # run time of a step [s]
    wide: int = 1,  # columns [-]
    steps: Steps = Steps(dt=1e-3, t_end=0.01),
    output: Output = Output("out/toy"),
):
    """A mass falls."""
    columns = {f"y{k}": ("m", "height", lambda step: -4.905 * step.time**2) for k in range(wide)}
    return Run("toy", Mass(pause=pause), None, steps, output, columns=columns)


if __name__ == "__main__":
    main.run()
