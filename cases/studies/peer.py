"""The sphere on the beam on another program, measured on this machine, with the errors of
``cases/beam_impact.py``.

The program is a script of its own interpreter that takes --work DIR --steps N --dt S --csv FILE --summary
FILE and the beam (--length --radius --E --nu --rho --v0). It writes a CSV with t_s, contact_force_dem_N,
interface_mid_disp_m and sphere_vel_m_s, and a JSON with the median seconds of a step in median_s.total. Time
is that median times the number of steps: what the script spends on recording and starting is left out, in the
peer's favour.
"""
import itertools
import json
import os
import subprocess
from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from coupling.cli import UsageError
from coupling.records import report
from coupling.records.writing import tell
from references import beam_theory

BEAM = dict(length=0.1535, radius=0.01, v0=0.01, E=215.82e9, nu=0.289, rho=7960.0)  # as cases/beam_impact.py
SECTION, T_END, MODES = (0.01, 0.01), 4e-4, 50


def plan(own: Dict[str, str]) -> List[Dict[str, str]]:
    """Runs of the peer from the tool's own keys: peer_NAME=a,b is swept and passed on as --NAME; a list of
    dictionaries, empty when there is no ``peer``. UsageError when what belongs together is not complete."""
    given = {key[len("peer_"):]: text.split(",") for key, text in own.items() if key.startswith("peer_")}
    if "peer" not in own and not given and "script" not in own:
        return []
    if "peer" not in own or "script" not in own or not Path(own["script"]).is_file():
        raise UsageError("the peer needs peer=INTERPRETER and script=FILE, a script that exists")
    given.setdefault("dt", ["1e-6"])
    return [dict(zip(given, values)) for values in itertools.product(*given.values())]


def measure(python: str, script: str, runs: List[Dict[str, str]], folder: Path,
            repeat: int = 1) -> List[dict]:
    """Rows of an overlay (label, time_s, error_NAME), one per run of the peer, the fastest of ``repeat``;
    those finished before are kept. RuntimeError when the peer's script fails."""
    rows, b = [], BEAM
    reference = beam_theory.impact(b["length"], *SECTION, b["radius"], b["v0"], b["E"], b["nu"], b["rho"],
                                   T_END, modes=MODES)
    for options in runs:
        note = " ".join(f"{k}={v}" for k, v in options.items())
        best: Any = None
        for attempt in range(repeat):
            work = Path(folder) / note.replace(" ", "_").replace("/", "_") / str(attempt)
            if not (work / "summary.json").is_file():
                _start(python, script, options, work)
            seconds = json.loads((work / "summary.json").read_text())["median_s"]["total"]
            best = seconds if best is None else min(best, seconds)
        history = np.genfromtxt(work / "history.csv", delimiter=",", names=True)
        errors = compare(history, reference)
        rows.append({"label": f"peer: {note}", "time_s": best * len(history),
                     **{f"error_{n}": e for n, e in errors.items()}})
        shown = ", ".join(f"{n} {e:.3g}" for n, e in errors.items())
        tell(f"{rows[-1]['label']}: {rows[-1]['time_s']:.3g} s, {shown}")
    return rows


def compare(history: np.ndarray, reference: Any) -> Dict[str, float]:
    """Errors as in the case. The peer's force is the one at the end of each step, and is compared there."""
    at = reference.at(np.minimum(history["t_s"], reference.time[-1]))
    return {"force": report.relative_l2(history["contact_force_dem_N"], at.force),
            "u_beam": report.relative_l2(history["interface_mid_disp_m"], at.u_beam),
            "v_sphere_end": float(abs(history["sphere_vel_m_s"][-1] / at.v_sphere[-1] - 1))}


def _start(python: str, script: str, options: Dict[str, str], work: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    steps = round(T_END / float(options["dt"]))
    words = ["--work", work / "files", "--steps", steps, "--csv", work / "history.csv",
             "--summary", work / "unfinished.json"]
    for key, value in {**BEAM, **options}.items():
        words += [f"--{key}", value]
    environ = {"OMP_NUM_THREADS": "1", **os.environ}
    with open(work / "log.txt", "w") as log:
        status = subprocess.run([python, script, *map(str, words)], stdout=log, stderr=log,
                                env=environ).returncode
    if status or not (work / "unfinished.json").is_file():
        raise RuntimeError(f"the peer's script failed with status {status}: see {work / 'log.txt'}")
    (work / "unfinished.json").rename(work / "summary.json")  # last, so that a stopped run is made again
