"""Runs of a case over a grid of its keys: each in a process of its own, resumable, failed ones with their
reason."""
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple, Union

from coupling import signals
from coupling.cli import EXPECTED, UsageError, once
from coupling.records.writing import tell

TUPLE = re.compile(r"-?[\d.]+(e[+-]?\d+)?(x-?[\d.]+(e[+-]?\d+)?)+")  # 62x13: one value of several numbers
DONE = "run.json"  # last file of a finished run
PATIENCE = 10.0  # [s] for a run that was told to end


class Result(NamedTuple):
    """One run: its swept ``keys`` (name → text); ``status``, "ok" or why not; seconds in windows and in all,
    largest memory of a rank [MB], None where the run failed; ``errors``: name → number; ``sentence``: whether
    the run itself said why it failed; ``warnings``: what it warned of."""

    keys: dict
    status: str
    window_s: Any = None
    wall_s: Any = None
    peak_mb: Any = None
    errors: dict = {}
    sentence: bool = False
    warnings: tuple = ()


def parse(words: Sequence[str],
          own: Sequence[str] = ()) -> Tuple[Dict[str, List[str]], List[str], Dict[str, str]]:
    """Words of a command line → (swept keys: name → texts, words that every run gets, own keys of the tool:
    name → text). ``own``: their names, which the case does not get to see. UsageError for a word that is no
    key=value and for a key or a value given twice."""
    swept, fixed, mine, after_option = {}, [], {}, False
    seen: Set[str] = set()
    for word in words:
        key, equals, text = word.partition("=")
        if word.startswith("-") or (not equals and after_option):
            # PETSc's; a value, if it has one, follows as a word of its own
            after_option = word.startswith("-")
            fixed.append(word)
            continue
        if not equals or not text:
            raise UsageError(f"{word!r} is not key=value nor key=value,value,…: give it so")
        once(key, text, seen)
        seen.add(key)
        if key in own or any(name.endswith("_") and key.startswith(name) for name in own):
            mine[key] = text
        elif len(values := text.split(",")) > 1:
            if "" in values or len(set(values)) < len(values):
                raise UsageError(f"{word!r} has {'an empty value' if '' in values else 'a value twice'}: "
                                 "separate different values by single commas")
            swept[key] = values
        else:
            fixed.append(f"{key}={as_typed(text)}")
    return swept, fixed, mine


def as_typed(text: str) -> str:
    """A value of a sweep as the case reads it: 62x13 is 62,13."""
    return text.replace("x", ",") if TUPLE.fullmatch(text) else text


def combinations(swept: Dict[str, List[str]]) -> List[Dict[str, str]]:
    """Every combination of the swept values, as dictionaries; the last key changes fastest."""
    return [dict(zip(swept, values)) for values in itertools.product(*swept.values())]


def run(case: Union[str, Path], keys: Dict[str, str], fixed: Sequence[str], folder: Union[str, Path], *,
        repeat: int = 1, timeout: Optional[float] = None) -> Result:
    """Run ``case`` (a script) with ``keys`` and the words ``fixed``, results below ``folder``; a finished run
    of the same words is not repeated. repeat: runs, of which the one with the least time in windows counts.
    timeout [s] of each."""
    folder = Path(folder) / (re.sub(r"[^\w.=,+-]", "_", "_".join(f"{k}={v}" for k, v in keys.items()))
                             or "run")
    words = [str(Path(case).resolve()), *(f"{k}={as_typed(v)}" for k, v in keys.items()), *fixed]
    try:
        kept = json.loads((folder / DONE).read_text())
        if kept["words"] == words and kept["repeat"] >= repeat:
            return Result(**kept["result"])._replace(warnings=tuple(kept["result"].get("warnings", ())))
    except (OSError, ValueError, KeyError, TypeError):
        pass  # not there, not finished or not readable: run it
    best: Any = None
    for _ in range(repeat):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        status, sentence = _start([*words, f"out={folder}"], folder, timeout)
        result = _read(folder, keys, status)._replace(sentence=sentence,
                                                      warnings=tuple(_said(folder, "warning: ")))
        if result.status != "ok":
            best = result
            break
        best = result if best is None or result.window_s < best.window_s else best
    (folder / DONE).write_text(json.dumps({"words": words, "repeat": repeat, "result": best._asdict()},
                                          indent=1))
    return best


def environment() -> Dict[str, str]:
    """For a process that runs a case: the packages of this project, without what MPI tells its own
    children."""
    paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {"OMP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def _start(words: List[str], folder: Path, timeout: Optional[float]) -> Tuple[str, bool]:
    """Run the script and wait; "ok" or one sentence why it failed, and whether the script itself said so."""
    with open(folder / "stdout.txt", "w") as out, open(folder / "stderr.txt", "w") as err:
        process = subprocess.Popen([sys.executable, *words], stdout=out, stderr=err, env=environment())
        try:
            process.wait(timeout)
        except subprocess.TimeoutExpired:
            return f"stopped after {timeout:g} s", False
        finally:
            _stop(process)  # interrupted ourselves, or too late
    if process.returncode == 0:
        return "ok", False
    if process.returncode < 0:
        return f"killed by {signal.Signals(-process.returncode).name}", False
    said = _said(folder, "error: ")
    return (said or _said(folder, "")[-1:] or [f"exit status {process.returncode}"])[0], bool(said)


def _said(folder: Path, kind: str) -> List[str]:
    """Lines that a run wrote to stderr, those that begin with ``kind``, without it."""
    lines = (folder / "stderr.txt").read_text(errors="replace").splitlines()
    return [line[len(kind):] for line in lines if line.strip() and line.startswith(kind)]


def _stop(process: subprocess.Popen) -> None:
    """End a process that still runs, by force if it does not listen."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _read(folder: Path, keys: Dict[str, str], status: str) -> Result:
    """What the report of a run says."""
    if status != "ok":
        return Result(keys, status)
    try:
        report = json.loads((folder / "report.json").read_text())
        window_s = report.get("window_s", report["wall_s"] - report["startup_s"])
        return Result(keys, "ok", window_s, report["wall_s"], max(report["peak_mb"]), report["errors"])
    except (OSError, ValueError, KeyError) as error:
        return Result(keys, f"no usable report.json ({type(error).__name__}: {error})")


def end(main: Callable[[List[str]], Optional[int]]) -> None:
    """Call ``main`` with the words of the command line, and end as it ends: a tool's last line."""
    help_only = {"-h", "--help"} & set(sys.argv)
    try:
        with nullcontext() if help_only else signals.like_interrupts():
            status = main(sys.argv[1:])
    except UsageError as error:
        status = 2
        tell(f"error: {error}", sys.stderr)
    except EXPECTED as error:
        status = 1
        tell(f"error: {error}", sys.stderr)
    except KeyboardInterrupt:
        status = 130
        tell("interrupted; the same command goes on from here", sys.stderr)
    sys.exit(status)
