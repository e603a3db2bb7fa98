"""What iterating brings: error against the window, iterations by method, and the ratio of the masses.

    python tests/benchmarks/bench_coupling.py [parts=rates,methods,masses]

A coarse beam, struck by the sphere, with the built-in DEM and DEM steps of 5e-8 s. Prints Markdown for
docs/coupling.md; nothing passes or fails here.
"""
import contextlib
import io
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "cases")]
WORDS, sys.argv[1:] = sys.argv[1:], []  # PETSc would read them

import beam_impact  # noqa: E402

INNER = 5e-8  # [s]
MESH = dict(cells=(31, 7), body=(60, 4), points=3, segments=(30,))
ITERATED = dict(iterate=50, tol=1e-6)
SHOWN = ("u_beam", "u_sphere", "v_sphere")
# mass of the beam [kg], volume of the sphere [m^3]
BEAM, VOLUME = 7960.0 * 0.1535 * 1e-4, 4.0 / 3.0 * np.pi * 1e-6


def run(substeps, t_end=1.92e-4, **keys):
    """History of a run with windows of so many DEM steps, or the first words of the error."""
    with tempfile.TemporaryDirectory() as out, contextlib.redirect_stdout(io.StringIO()), np.errstate(
            all="ignore"):
        try:
            (history,) = beam_impact.main(**MESH, dt=substeps * INNER, substeps=substeps, t_end=t_end,
                                          out=out, **keys).values()
        except (RuntimeError, ArithmeticError, ValueError) as error:
            return str(error).split(":")[0]
    return history


def differences(history, fine):
    """Largest difference of each quantity at six times from the one with short windows, relative to its
    largest."""
    times = 3.2e-5 * np.arange(1, 7)
    return [max(abs(np.interp(times, history["time"], history[name]) - np.interp(times, fine["time"],
                                                                                 fine[name])))
            / abs(fine[name]).max() for name in SHOWN]


def rates():
    fine = run(5, **ITERATED)
    print("| window [s] | coupling | u_beam | rate | u_sphere | rate | v_sphere | rate | interface_error |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, keys in (("weak", {}), ("iterated", ITERATED)):
        before = None
        for substeps in (320, 160, 80, 40, 20, 10):
            history = run(substeps, **keys)
            errors = differences(history, fine)
            slopes = ["" if before is None else f"{np.log2(b / e):.2f}" for b, e in zip(before or errors,
                                                                                        errors)]
            cells = " | ".join(f"{e:.2e} | {s}" for e, s in zip(errors, slopes))
            print(f"| {substeps * INNER:.2g} | {name} | {cells} | {history['interface_error'][-1]:.1e} |",
                  flush=True)
            before = errors


def methods():
    print("| window [s] | tol | Aitken | IQN-ILS | constant 0.5 |\n|---|---|---|---|---|")
    for substeps in (320, 80, 20):
        for tol in (1e-3, 1e-4, 1e-6):
            cells = []
            for relax in ("aitken", "iqn", "constant"):
                history = run(substeps, iterate=100, tol=tol, relax=relax, t_end=1.6e-4)
                cells.append(history if isinstance(history, str) else
                             f"{history['iterations'].mean():.2f} ({history['iterations'].max():.0f})")
            print(f"| {substeps * INNER:.2g} | {tol:g} | " + " | ".join(cells) + " |", flush=True)


def masses():
    """The force against short windows; the sphere stays on the beam, or comes back, the longer the heavier it
    is."""
    print("| sphere / beam | window [s] | weak | iterated | computations | weak, adapt=0.02 | windows |")
    print("|---|---|---|---|---|---|---|")
    for ratio in 10.0 ** np.arange(-3, 4):
        keys = dict(rho_sphere=ratio * BEAM / VOLUME, t_end=5.76e-4)
        fine = run(20, **keys, iterate=50)
        for substeps in (80, 320, 960):
            weak, both, short = (run(substeps, **keys, **more) for more in ({}, dict(iterate=50),
                                                                            dict(adapt=0.02)))
            computations, windows = ("" if isinstance(h, str) else text(h) for h, text in (
                (both, lambda h: f"{h['iterations'].mean():.2f}"), (short, len)))
            print(f"| {ratio:g} | {substeps * INNER:.2g} | {told(weak, fine)} | {told(both, fine)} | "
                  f"{computations} | {told(short, fine)} | {windows} |", flush=True)


def told(history, fine):
    """Largest difference of the impulse so far from the one with short windows, relative to its largest; or
    what went wrong."""
    if isinstance(history, str):
        return history
    times = 4.8e-5 * np.arange(1, 13)
    one, other = (np.interp(times, h["time"], np.cumsum(h["force"] * h["window"])) for h in (history, fine))
    return f"{abs(one - other).max() / abs(other).max():.1e}"


if __name__ == "__main__":
    asked = dict(word.split("=") for word in WORDS).get("parts", "rates,methods,masses")
    for part in asked.split(","):
        print(f"\n## {part}\n")
        {"rates": rates, "methods": methods, "masses": masses}[part]()
