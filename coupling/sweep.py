"""Runs of a case over a grid of its keys: each in a process of its own, resumable, failed ones with their reason."""
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import NamedTuple

from .cli import UsageError

TUPLE = re.compile(r"-?[\d.]+(e[+-]?\d+)?(x-?[\d.]+(e[+-]?\d+)?)+")  # 62x13: one value of several numbers
DONE = "run.json"  # last file of a finished run


class Result(NamedTuple):
    """One run: its swept ``keys`` (name → text); ``status``, "ok" or why not; seconds in windows and in all, largest
    memory of a rank [MB], None where the run failed; ``errors``: name → number."""

    keys: dict
    status: str
    window_s: float = None
    wall_s: float = None
    peak_mb: float = None
    errors: dict = {}


def parse(words, own=()):
    """Words of a command line → (swept keys: name → texts, words that every run gets, own keys of the tool: name →
    text). ``own``: their names, which the case does not get to see. UsageError for a word that is no key=value."""
    swept, fixed, mine, after_option = {}, [], {}, False
    for word in words:
        key, equals, text = word.partition("=")
        if word.startswith("-"):
            after_option = True  # PETSc's; a value, if it has one, follows as a word of its own
            fixed.append(word)
        elif not equals and after_option:
            after_option = False
            fixed.append(word)
        elif not equals or not text:
            raise UsageError(f"{word!r} is not key=value nor key=value,value,…")
        elif key in own or any(name.endswith("_") and key.startswith(name) for name in own):
            mine[key] = text
        elif len(values := text.split(",")) > 1:
            if "" in values:
                raise UsageError(f"{word!r} has an empty value: separate the values by single commas")
            swept[key] = values
        else:
            fixed.append(f"{key}={as_typed(text)}")
    return swept, fixed, mine


def as_typed(text):
    """A value of a sweep as the case reads it: 62x13 is 62,13."""
    return text.replace("x", ",") if TUPLE.fullmatch(text) else text


def combinations(swept):
    """Every combination of the swept values, as dictionaries; the last key changes fastest."""
    return [dict(zip(swept, values)) for values in itertools.product(*swept.values())]


def run(case, keys, fixed, folder, *, repeat=1, timeout=None):
    """Run ``case`` (a script) with ``keys`` and the words ``fixed``, results below ``folder``; a finished run of the
    same words is not repeated. repeat: runs, of which the one with the least time in windows counts. timeout [s] of
    each."""
    folder = Path(folder) / (re.sub(r"[^\w.=,+-]", "_", "_".join(f"{k}={v}" for k, v in keys.items())) or "run")
    words = [str(Path(case).resolve()), *(f"{k}={as_typed(v)}" for k, v in keys.items()), *fixed]
    try:
        kept = json.loads((folder / DONE).read_text())
        if kept["words"] == words and kept["repeat"] >= repeat:
            return Result(**kept["result"])
    except (OSError, ValueError, KeyError, TypeError):
        pass  # not there, not finished or not readable: run it
    best = None
    for _ in range(repeat):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        status = _start([*words, f"out={folder}"], folder, timeout)
        result = _read(folder, keys, status)
        if result.status != "ok":
            best = result
            break
        best = result if best is None or result.window_s < best.window_s else best
    (folder / DONE).write_text(json.dumps({"words": words, "repeat": repeat, "result": best._asdict()}, indent=1))
    return best


def environment():
    """For a process that runs a case: the packages of this project, without what MPI tells its own children."""
    paths = [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {"OMP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def _start(words, folder, timeout):
    """Run the script and wait; "ok" or one sentence why it failed."""
    with open(folder / "stdout.txt", "w") as out, open(folder / "stderr.txt", "w") as err:
        process = subprocess.Popen([sys.executable, *words], stdout=out, stderr=err, env=environment())
        clock = threading.Timer(timeout or threading.TIMEOUT_MAX, process.send_signal, [signal.SIGTERM])
        clock.daemon = True
        try:
            if timeout:
                clock.start()
            process.wait()
        finally:
            in_time = not timeout or clock.is_alive()
            clock.cancel()
            if process.poll() is None:  # interrupted ourselves
                process.terminate()
                process.wait()
    if process.returncode == 0:
        return "ok"
    if not in_time:
        return f"stopped after {timeout:g} s"
    if process.returncode < 0:
        return f"killed by {signal.Signals(-process.returncode).name}"
    lines = [line for line in (folder / "stderr.txt").read_text(errors="replace").splitlines() if line.strip()]
    return next((line[len("error: "):] for line in lines if line.startswith("error: ")),
                lines[-1] if lines else f"exit status {process.returncode}")


def _read(folder, keys, status):
    """What the report of a run says."""
    if status != "ok":
        return Result(keys, status)
    try:
        report = json.loads((folder / "report.json").read_text())
        window_s = report.get("window_s", report["wall_s"] - report["startup_s"])
        return Result(keys, "ok", window_s, report["wall_s"], max(report["peak_mb"]), report["errors"])
    except (OSError, ValueError, KeyError) as error:
        return Result(keys, f"no usable report.json ({type(error).__name__}: {error})")
