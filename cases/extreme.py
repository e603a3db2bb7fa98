"""A sphere and an elastic block in stiff and extreme conditions, each against what must come out: the rows of
the stability matrix (``studies/matrix.py``).

    python cases/extreme.py                                a steel sphere on a beam
    python cases/extreme.py scene=free mass_ratio=1e3      a heavy sphere strikes a body that flies away
    python cases/extreme.py scene=rest windows=10000       a sphere lies on a block, under its weight
    python cases/extreme.py unit=1e-6,1e-3,1e-9            the beam in micrometres, milliseconds, micrograms

Scenes: ``beam``, supported at its ends; ``block``, held at its bottom; ``free``, held by nothing; ``layers``,
a block on another one of the modulus E / contrast, held at its bottom; ``rest``, the block with a sphere laid
on it; ``swing``, the beam alone in its first mode; ``flight``, the free block alone, flying and vibrating.
``studies/extreme_references.py`` says what each is compared with.
"""
from dataclasses import replace
from pathlib import Path
from typing import Literal, Optional, Tuple

import numpy as np

from coupling import Output, Run, Scheme, case
from dem_liggghts import critical_step
from mpm_fenicsx import Numerics
from studies import extreme_references as known
from studies.extreme_keys import COUNTS, Ball, Block, Extreme, Resolution, Windows, check_keys
from studies.extreme_scene import interface_on, make_grains, make_mapping, make_solid


@case(counts=COUNTS)
def main(
    scene: Literal["beam", "block", "free", "layers", "rest", "swing", "flight"] = "beam",  # as above
    dim: Literal[2, 3] = 2,  # in the plane or in space
    block: Block = Block(),
    ball: Ball = Ball(),
    resolution: Resolution = Resolution(),
    windows: Windows = Windows(),
    unit: Tuple[float, float, float] = (1.0, 1.0, 1.0),  # in which the numbers above are given [m, s, kg]
    numerics: Numerics = Numerics(),
    output: Output = Output(Path("out/extreme")),
) -> Run:
    """A sphere and an elastic block in extreme conditions, against conservation, kinematics, Hertz, beams."""
    given = Extreme(scene, dim, block, ball, resolution, windows, unit, numerics)
    check_keys(given.keys)
    p, other, against = known.timed(given.in_si()), known.twin(given), None
    if other is not None:
        q = known.timed(other.in_si())
        (history,) = run_of(q, replace(output, out=Path(output.out) / "twin")).go(other.keys).values()
        against = q, history
    return run_of(p, output, against)


def run_of(p: Extreme, output: Output, against: Optional[tuple] = None) -> Run:
    """The run of a scene in SI units. against: (its scene, its history) of the ``known.twin``, or None."""
    interface, w = interface_on(p), p.windows
    solid, grains = make_solid(p, interface), make_grains(p, interface)
    substeps = w.substeps or max(1, int(np.ceil(2 * p.dt / min(*critical_step(grains), 1e6 * p.dt))))
    scheme = Scheme(dt=p.dt, t_end=w.windows * p.dt, substeps=substeps, iterate=w.iterate, adapt=w.adapt,
                    dem=w.dem)
    errors = lambda histories: known.errors(p, next(iter(histories.values())), against)
    return Run("extreme", solid, grains, scheme, output, mapping=make_mapping(p, interface),
               columns=known.columns(p, solid), errors=errors, closed=True)


if __name__ == "__main__":
    main.run()
