"""What boulders in a flow cost: a scene of the cases as it flows, with its boulders and without, which go on
in turns, so many windows each. Seconds are those of the processor.

    ./dev run python tests/benchmarks/flow.py scene=boulder_barrier [h=0.025] [dt=1e-3] [start=0.1]
        [turns=5] [windows=10] [dem=reference]
    ./dev run python tests/benchmarks/flow.py scene=flume [h=0.2] [dt=4e-3] [start=0.2]

scene=boulder_barrier: soil with five boulders, three inside it, on a chute of 35 degrees, too long for the
barrier to be reached; scene=flume: sand that carries eight blocks, here as heavy as rock. Counted is what
comes after ``start`` [s]; ``-mpm_...`` goes to PETSc.
"""
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from time import process_time

WORDS = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
sys.argv[1:] = [word for word in sys.argv[1:] if "=" not in word]
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "cases"))

import boulder_barrier  # noqa: E402
import flume  # noqa: E402

from coupling import Scheme, couple, march, same  # noqa: E402
from coupling.loop import window as loop  # noqa: E402
from mpm_fenicsx.solve import clock  # noqa: E402

clock.perf_counter = loop.perf_counter = process_time  # phases too: the machine changes its pace
KEYS = {"boulder_barrier": dict(h=0.025, dt=1e-3, start=0.1), "flume": dict(h=0.2, dt=4e-3, start=0.2)}


def scene(name, boulders, h, scheme):
    """The ``Run`` of a scene, which is not begun."""
    if name == "flume":
        return flume.main.__wrapped__(h=h, blocks=boulders, rho_block=2600.0, scheme=scheme)
    return boulder_barrier.main.__wrapped__(  # without them, one before the soil, that is not used
        deposit=(0.8, 0.32, 0.32), path=1.5, spheres=2 if boulders else 1, clusters=3 if boulders else 0,
        boulder=0.05, rock_E=1e9, h=h, scheme=scheme)


class Side:
    """A scene that goes on by some windows at a time; ``rows``: of each window its seconds by phase, Newton
    iterations, tangents and attempts."""

    def __init__(self, run, backend):
        self.solid, self._scheme = run.solid, run.scheme
        self._grains = run.grains.open(backend, run.scheme.inner) if backend else None
        self._last, self._tangents, self._made = None, None, 0
        self.rows = []

    def go_on(self, t_end):
        """Until ``t_end`` [s]."""
        self._before, self._began = dict(self.solid.phases), process_time()
        scheme = replace(self._scheme, t_end=t_end)
        if self._grains is None:
            march(self.solid, scheme, [self._look], self._last)
        else:
            couple(self.solid, self._grains, same(), scheme, [self._look], self._last)

    def _look(self, window):
        now, tangents = process_time(), self.solid.step.tangents
        row = {name: seconds - self._before[name] for name, seconds in self.solid.phases.items()}
        row |= {name: seconds for name, seconds in window.seconds.items() if name != "MPM"}
        row["the rest"] = now - self._began - sum(row.values())
        row["all"] = now - self._began
        made = tangents.count - (self._made if tangents is self._tangents else 0)
        row.update(iterations=self.solid.iterations, tangents=made, failed=window.failed,
                   balls=len(window.x) if self._grains else 0)
        self.rows.append(row)
        self._tangents, self._made, self._last = tangents, tangents.count, window
        self._before, self._began = dict(self.solid.phases), process_time()

    def means(self, first):
        """Of the rows from the ``first`` on."""
        rows = self.rows[first:]
        return {name: sum(row.get(name, 0.0) for row in rows) / len(rows) for name in rows[0]}


def told(means):
    """Milliseconds of a window and Newton iterations, and both as a ratio of with to without."""
    without, with_them = means.values()
    return (f"{1e3 * without['all']:.1f} and {1e3 * with_them['all']:.1f} ms, "
            f"{without['iterations']:.2f} and {with_them['iterations']:.2f} iterations, ratios "
            f"{with_them['all'] / without['all']:.3f}, {with_them['iterations'] / without['iterations']:.3f}")


def main(name="boulder_barrier", turns=5, windows=10, backend="reference", **given):
    """Print the means."""
    warnings.simplefilter("ignore")
    keys = {**KEYS[name], **given}
    scheme = Scheme(dt=keys["dt"], t_end=1.0, substeps=64 if name == "boulder_barrier" else 256)
    sides = {with_them: Side(scene(name, with_them == "with boulders", keys["h"], scheme), one)
             for with_them, one in (("without", None), ("with boulders", backend))}
    for side in sides.values():
        side.go_on(keys["start"])
    first = [len(side.rows) for side in sides.values()]
    for turn in range(turns):
        begun = [len(side.rows) for side in sides.values()]
        for side in sides.values():
            side.go_on(keys["start"] + (turn + 1) * windows * keys["dt"])
        means, of_turn = ({with_them: side.means(at) for at, (with_them, side) in zip(since, sides.items())}
                          for since in (first, begun))
        print(f"{name}, {[side.solid.count for side in sides.values()]} points, t = "
              f"{sides['without'].solid.time:.3f} s: {told(of_turn)}; so far {told(means)}", flush=True)
    for with_them, mean in means.items():
        counts = {key: mean.pop(key) for key in ("iterations", "tangents", "failed", "balls")}
        print(f"    {with_them}: " + ", ".join(f"{key} {1e3 * value:.1f} ms" for key, value in mean.items()) +
              ", " + ", ".join(f"{value:.2f} {key}" for key, value in counts.items()))


if __name__ == "__main__":
    numbers = {key: float(WORDS[key]) for key in ("h", "dt", "start") if key in WORDS}
    main(WORDS.get("scene", "boulder_barrier"), int(WORDS.get("turns", 5)), int(WORDS.get("windows", 10)),
         WORDS.get("dem", "reference"), **numbers)
