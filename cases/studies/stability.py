"""Stiff and extreme cases: a matrix of runs, each with the outcome that was expected of it, classified.

    python -m coupling.stability                       the whole matrix, matrix.py beside this file
    python -m coupling.stability units mass_1e3 jobs=2 these groups and rows, two at a time

Keys: out=DIR, folder of the results (out/stability); jobs=N, runs at a time (as many as processors);
timeout=SECONDS of one run (120); matrix=FILE (matrix.py beside this file). Every run has a process of its
own. A matrix that was stopped goes on where it was (remove the folder after a change of the program).

A matrix is a Python file that defines CASE, the script that runs a row, from its own folder on, and ROWS, a
list of tuples

    (group, name, words, expected, bounds, why)

words: of the command line of CASE, separated by blanks; expected: "right", "inaccurate" or "stopped"; bounds:
error measure of the case's report → largest value; why: where the expectation comes from. The case reports
``energy_gain``, the largest gain of total energy relative to the largest energy so far; it is bounded by
ENERGY unless the row says otherwise. Each run is

    right        it came to its end and no error exceeds its bound,
    inaccurate   it is stable, all numbers finite and the energy within its bound, but an error exceeds its
                 bound,
    stopped      it ended with one sentence that says why,
    wrong        anything else: a crash, a hang, a number that is not finite, energy out of nothing.

It leaves stability.csv and stability.md, written anew after every run, and stability.png; the exit status is
1 when a run is wrong.
"""
import csv
import difflib
import math
import os
import re
import runpy
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Tuple, Union

import mpm_dem_checks as check
from coupling import cli
from coupling.pictures import figure
from coupling.records import report
from coupling.records.writing import tell
from studies import sweep

CLASSES = ("right", "inaccurate", "stopped", "wrong")
ENERGY = 0.05
NAME = re.compile(r"[\w.+-]+")  # of a row and its folder
# how cli.run begins its last sentence after an error that nobody expected
BUG = "this is a bug in the program"
HEAD = ("group", "row", "words", "expected", "found", "measure", "error", "bound", "energy_gain", "window_s",
        "says", "why")


class Row(NamedTuple):
    """One run of the matrix, see above."""

    group: str
    name: str
    words: str
    expected: str
    bounds: dict
    why: str


class Outcome(NamedTuple):
    """What became of a row: its class ``found``, the error measure closest to its bound or beyond, and a
    sentence."""

    row: Row
    found: str
    measure: str = ""
    error: float = math.nan
    bound: float = math.nan
    energy_gain: float = math.nan
    window_s: Any = math.nan
    says: str = ""


def main(words: List[str]) -> int:
    """Run the rows that the words of the command line ask for; returns the exit status."""
    if {"-h", "--help"} & set(words):
        tell(__doc__)
        return 0
    own: Dict[str, str] = {}
    for key, text in (word.split("=", 1) for word in words if "=" in word):
        cli.once(key, text, own)
        own[key] = text
    if unknown := set(own) - {"out", "jobs", "timeout", "matrix"}:
        raise cli.UsageError(f"unknown key {sorted(unknown)[0]!r}; known keys: out, jobs, timeout, matrix")
    jobs, timeout = (cli.convert(name, own.get(name, str(default)), kind)
                     for name, default, kind in (("jobs", os.cpu_count(), int), ("timeout", "120", float)))
    jobs = cli.checked(check.count, "jobs", jobs, most=1000)
    timeout = cli.checked(check.positive, "timeout", timeout, unit="s")
    case, rows = read(own.get("matrix", Path(__file__).with_name("matrix.py")))
    rows = choose(rows, [word for word in words if "=" not in word])
    out = cli.checked(check.path, "out", own.get("out", "out/stability"))
    out.mkdir(parents=True, exist_ok=True)
    outcomes = run(case, rows, out, jobs, timeout)
    figure.draw_matrix(out / "stability.png", [(o.row.group, o.row.name, o.found, o.error / o.bound)
                                               for o in outcomes])
    surprises = sum(one.found != one.row.expected for one in outcomes)
    tell(f"{summary(outcomes)}; {surprises} not as expected; table and figure in {out}")
    return int(any(o.found == "wrong" for o in outcomes))


def read(path: Union[str, Path]) -> Tuple[Path, List[Row]]:
    """Case and rows of a matrix; UsageError for one that does not make sense."""
    path = Path(cli.checked(check.file, "matrix", path))
    try:
        content = runpy.run_path(str(path))
        script, entries = path.parent / content["CASE"], list(content["ROWS"])
    except Exception as error:  # whatever is wrong with somebody's Python file
        raise cli.UsageError(f"matrix={path} cannot be read ({type(error).__name__}: {error}): give a Python "
                             "file with CASE, the path of a script from its folder on, and ROWS") from None
    rows = [_row(number, entry) for number, entry in enumerate(entries, 1)]
    if len({row.name for row in rows}) < len(rows):
        raise cli.UsageError(f"matrix={path} has two rows of one name: rename one")
    cli.checked(check.file, f"CASE of matrix={path}", script)
    return script, rows


def _row(number: int, entry: Any) -> Row:
    """One tuple of a matrix as a ``Row``; UsageError for one that is none."""
    form = isinstance(entry, (tuple, list)) and len(entry) == len(Row._fields)
    if not form or not all(isinstance(text, str) for text in (*entry[:4],
                                                              entry[5])) or not isinstance(entry[4], dict):
        raise cli.UsageError(f"row {number} of the matrix is {check.shown(entry)}: give a tuple of "
                             f"{len(Row._fields)}, {', '.join(Row._fields)}, of which bounds is a "
                             "dictionary and the others are texts")
    row = Row(*entry)
    if not NAME.fullmatch(row.name) or ".." in row.name:
        raise cli.UsageError(f"row {number} of the matrix is called {row.name!r}, which is to be the name of "
                             "a folder: give letters, digits, single points and _+-")
    if row.expected not in CLASSES[:3]:
        raise cli.UsageError(f"row {row.name} expects {row.expected!r}: choose one of "
                             f"{', '.join(CLASSES[:3])}")
    if not row.why or not (row.bounds or row.expected == "stopped"):
        raise cli.UsageError(f"row {row.name} does not say why, or has no bound of an error: write it down")
    for measure, bound in row.bounds.items():
        cli.checked(check.positive, f"the bound of {measure} in row {row.name}", bound)
    return row


def choose(rows: List[Row], names: List[str]) -> List[Row]:
    """The rows of these names and groups, all of them for no name."""
    known = [*dict.fromkeys(row.group for row in rows), *(row.name for row in rows)]
    for name in names:
        if name not in known:
            close = difflib.get_close_matches(name, known, 3)
            hint = f": did you mean {' or '.join(close)}?" if close else f"; groups: {', '.join(known[:12])}"
            raise cli.UsageError(f"there is no row or group {name!r}{hint}")
    return [row for row in rows if not names or {row.name, row.group} & set(names)]


def run(case: Path, rows: List[Row], out: Path, jobs: int, timeout: float) -> List[Outcome]:
    """Outcomes of the rows in their order; the table is written after each."""
    found = {}
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(outcome, case, row, out / "runs", timeout): row for row in rows}
        try:
            for number, done in enumerate(as_completed(waiting), 1):
                one = found[waiting[done].name] = done.result()
                tell(f"{number}/{len(rows)} {line(one)}")
                write(out, [found[row.name] for row in rows if row.name in found])
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [found[row.name] for row in rows]


def outcome(case: Path, row: Row, folder: Path, timeout: float) -> Outcome:
    """Run one row, or read what it left, and judge it."""
    result = sweep.run(case, {}, row.words.split(), Path(folder) / row.name, timeout=timeout)
    return judge(row, result)


def judge(row: Row, result: sweep.Result) -> Outcome:
    """Class of a run, see above. result: ``sweep.Result``."""
    if result.status != "ok":
        stopped = result.sentence and not result.status.startswith(BUG)
        return Outcome(row, "stopped" if stopped else "wrong", says=result.status)
    bounds = {"energy_gain": ENERGY, **row.bounds}
    if missing := set(bounds) - set(result.errors):
        return Outcome(row, "wrong", says=f"the run does not report {', '.join(sorted(missing))}")
    infinite = [name for name, error in result.errors.items() if not math.isfinite(error)]
    if infinite:
        return Outcome(row, "wrong", infinite[0], says=f"{infinite[0]} is not a finite number")
    gain = result.errors["energy_gain"]
    measure = max(row.bounds or bounds, key=lambda name: result.errors[name] / bounds[name])
    error, bound = result.errors[measure], bounds[measure]
    right = error <= bound and row.bounds
    found = "wrong" if gain > bounds["energy_gain"] else "right" if right else "inaccurate"
    return Outcome(row, found, measure, error, bound, gain, result.window_s,
                   "" if row.bounds else "it came to its end, and no bound says how good it is")


def line(one: Outcome) -> str:
    """One outcome for the terminal."""
    surprise = "" if one.found == one.row.expected else f" (expected: {one.row.expected})"
    says = one.says or f"{shown(one)}, energy gain {one.energy_gain:.2g}"
    return f"{one.row.name}: {one.found}{surprise}; {says}"


def summary(outcomes: List[Outcome]) -> str:
    """How many runs there are of each class."""
    return ", ".join(f"{sum(one.found == kind for one in outcomes)} {kind}" for kind in CLASSES)


def shown(one: Outcome) -> str:
    """The error measure of an outcome and its bound."""
    return f"{one.measure} {one.error:.2g} (bound {one.bound:.2g})" if one.measure else ""


def write(out: Path, outcomes: List[Outcome]) -> None:
    """CSV and Markdown table into the folder ``out``."""
    with open(out / "stability.csv", "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(HEAD)
        for o in outcomes:
            numbers = ("" if math.isnan(n) else f"{n:.4g}" for n in (o.error, o.bound, o.energy_gain,
                                                                     o.window_s))
            error, bound, gain, window_s = numbers
            table.writerow([*o.row[:4], o.found, o.measure, error, bound, gain, window_s, o.says, o.row.why])
    lines = [f"{len(outcomes)} runs: {summary(outcomes)}. Bold: not what was expected.", "",
             "| row | words | expected, because | found | error (bound) | energy gain | says |",
             "|" + " --- |" * 7]
    for o in outcomes:
        found = o.found if o.found == o.row.expected else f"**{o.found}**"
        gain = "" if math.isnan(o.energy_gain) else f"{o.energy_gain:.1e}"
        lines.append(report.table_row([o.row.name, o.row.words, f"{o.row.expected}: {o.row.why}", found,
                                       shown(o), gain, o.says]))
    (out / "stability.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sweep.end(main)
