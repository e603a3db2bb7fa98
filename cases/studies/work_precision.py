"""Error against run time: a case over a grid of its keys, as CSV, Markdown table and figure with its Pareto
front.

    python -m coupling.work_precision cases/beam_impact.py h=5e-3,2.5e-3,2e-3 dt=1e-6,2e-6,4e-6 points=2
    python -m coupling.work_precision cases/beam_impact.py cells=31x7,62x13
    overlay=cases/references/kratos_beam.csv
    python -m coupling.work_precision cases/beam_impact.py dt=1e-6,2e-6 peer=PYTHON script=FILE
    peer_dt=1e-6,2e-6

A key with several values, separated by commas, is swept, one with a single value is given to every run, and
so are words with a dash. An x joins the numbers of one value: cells=62x13 is what the case itself reads as
cells=62,13. Keys of the tool:

    out=DIR          folder of the results, out/work_precision/CASE unless given; a sweep that was stopped
                     goes on here,
                     only runs that are not finished are made (remove the folder after a change of the
                     program)
    repeat=N         every run N times, of which the fastest counts (1)
    timeout=SECONDS  of one run; then it is stopped, and a failed row (none)
    show=NAME,NAME   error measures in table and figure, three at most there (unless given: all, and the first
                     three)
    curve=KEY        a swept key: each of its values is a curve of its own in the figure, as in
                     cases/beam_impact.py basis=linear,gimp h=5e-3,2e-3 curve=basis
    overlay=FILE     results of others: a CSV with the columns label, time_s and error_NAME, comments start
                     with #
    peer=PYTHON script=FILE peer_KEY=value,value
                     another program on the same beam, measured here, see peer.py beside this file

It leaves work_precision.csv (a column per swept key, then window_s, wall_s, peak_mb, status, warnings of the
case and error_NAME of each error measure), which grows with every run, and at the end work_precision.md and
work_precision.png. window_s is the time in coupling windows, without start-up and pictures. A run that fails
is a row with its reason.
"""
import csv
from math import inf
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

import mpm_dem_checks as check
from coupling import cli
from coupling.pictures import figure
from coupling.records.report import table_row
from coupling.records.writing import tell
from studies import peer, sweep

OWN = ("out", "repeat", "timeout", "show", "curve", "overlay", "peer", "script", "peer_")


def main(words: List[str]) -> int:
    """Run the sweep that the words of the command line ask for; returns the exit status."""
    if not words or {"-h", "--help"} & set(words):
        tell(__doc__)
        return 0
    case = cli.checked(check.path, "the script of a case", words[0])
    if not case.is_file():
        raise cli.UsageError(f"{words[0]!r} is not a file: the first word is the script of a case, such as "
                             "cases/beam_impact.py; name one")
    swept, fixed, own = sweep.parse(words[1:], OWN)
    repeat = cli.checked(check.count, "repeat", cli.convert("repeat", own.get("repeat", "1"), int))
    timeout = cli.convert("timeout", own["timeout"], float) if "timeout" in own else None
    if timeout is not None:
        cli.checked(check.positive, "timeout", timeout, unit="s")
    out = cli.checked(check.path, "out", own.get("out", f"out/work_precision/{case.stem}"))
    others = read_overlay(own["overlay"]) if "overlay" in own else []
    if "curve" in own:
        cli.checked(check.choice, "curve", own["curve"], choices=tuple(swept))
    peers = peer.plan(own)
    out.mkdir(parents=True, exist_ok=True)
    results, runs = [], sweep.combinations(swept)
    for number, keys in enumerate(runs, 1):
        results.append(sweep.run(case, keys, fixed, out / "runs", repeat=repeat, timeout=timeout))
        tell(f"{number}/{len(runs)} {_line(results[-1])}")
        write_csv(out / "work_precision.csv", swept, results)
    if peers:
        others = others + peer.measure(own["peer"], own["script"], peers, out / "peer", repeat)
    write(out, case.stem, swept, results, others, own.get("show"), own.get("curve"))
    tell(f"table, CSV and figure in {out}")
    if not any(result.status == "ok" for result in results):
        raise RuntimeError(f"no run of the sweep came to its end; the first: {results[0].status}")
    return 0


def _line(result: sweep.Result) -> str:
    keys = " ".join(f"{k}={v}" for k, v in result.keys.items())
    warned = "".join(f"\n    warning: {warning}" for warning in result.warnings)
    if result.status != "ok":
        return f"{keys}: {result.status}{warned}"
    errors = ", ".join(f"{n} {e:.3g}" for n, e in list(result.errors.items())[:3])
    return f"{keys}: {result.window_s:.3g} s, {errors}{warned}"


def read_overlay(path: str) -> List[dict]:
    """Rows of a CSV of others' results: name → text or number. UsageError when it is not one."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        return [{"label": row["label"], "time_s": float(row["time_s"]),
                 **{k: float(v) for k, v in row.items() if v and k.startswith("error_")}} for row in rows]
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise cli.UsageError(f"overlay={path} cannot be read ({error}): give a CSV with the columns label, "
                             "time_s and error_NAME") from None


def measures(results: List[sweep.Result]) -> List[str]:
    """Names of all error measures, in the order in which they come."""
    return list(dict.fromkeys(name for result in results for name in result.errors))


def write_csv(path: Path, swept: Dict[str, List[str]], results: List[sweep.Result]) -> None:
    """One row per run: its keys, seconds in windows and in all, memory [MB], status, warnings and errors."""
    names = measures(results)
    head = [*swept, "window_s", "wall_s", "peak_mb", "status", "warnings",
            *(f"error_{name}" for name in names)]
    rows = [[*r.keys.values(), r.window_s, r.wall_s, r.peak_mb, r.status, " / ".join(r.warnings),
             *(r.errors.get(n) for n in names)] for r in results]
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([head, *(["" if cell is None else cell for cell in row] for row in rows)])


def write(out: Path, title: str, swept: Dict[str, List[str]], results: List[sweep.Result],
          others: Sequence[dict] = (), show: Optional[str] = None, curve: Optional[str] = None) -> None:
    """Markdown table and figure of ``results`` into the folder ``out``. others: rows as of ``read_overlay``;
    show: error measures in the figure, separated by commas; curve: the swept key whose values are curves of
    their own. UsageError when a measure is not known."""
    names = measures(results)
    good = [r for r in results if r.status == "ok"]
    if not good:
        return
    shown = show.split(",") if show else names[:3]
    if unknown := set(shown) - set(names):
        raise cli.UsageError(f"show={','.join(sorted(unknown))}: the case has the errors {', '.join(names)}")
    (out / "work_precision.md").write_text(markdown(swept, results, others, shown if show else names),
                                           encoding="utf-8")
    panels = {f"error: {name}": [series for label, rows in _series(title, good, others, swept, curve)
                                 if (series := _points(label, rows, name))] for name in shown[:3]}
    figure.draw_work(out / "work_precision.png", "time in coupling windows [s]", panels)


def _series(title: str, good: List[sweep.Result], others: Sequence[dict],
            swept: Iterable[str], curve: Optional[str] = None) -> Iterator[tuple]:
    """(label, rows (time, errors, note)) of the case, of each value of ``curve`` in it, and of each of the
    others; these share a label up to their key."""
    of_value: Dict[Optional[str], list] = {}
    for r in good:
        note = " ".join(f"{k}={r.keys[k]}" for k in swept if k != curve)
        of_value.setdefault(r.keys[curve] if curve else None, []).append((r.window_s, r.errors, note))
    for value, rows in of_value.items():
        yield (f"{title}, {curve}={value}" if curve else title), rows
    groups: Dict[str, list] = {}
    for row in others:
        name, _, note = row["label"].partition(": ")
        errors = {k[len("error_"):]: v for k, v in row.items() if k.startswith("error_")}
        groups.setdefault(name, []).append((row["time_s"], errors, note))
    yield from groups.items()


def _points(label: str, rows: List[tuple], name: str) -> Optional[tuple]:
    """A series of ``figure.draw_work``, or None when nothing in it has that error."""
    rows = [(time, errors[name], note) for time, errors, note in rows if errors.get(name, 0) > 0]
    return (label, *zip(*rows)) if rows else None


def markdown(swept: Dict[str, List[str]], results: List[sweep.Result], others: Sequence[dict],
             names: List[str]) -> str:
    """The table of all runs with the errors ``names``, fastest first; bold: the Pareto front of the first of
    them."""
    good = sorted((r for r in results if r.status == "ok"), key=lambda r: r.window_s)
    best = set(figure.front([r.window_s for r in good], [r.errors[names[0]] for r in good]))
    lines = [table_row([*swept, "windows [s]", "whole run [s]", "memory [MB]", *names]),
             table_row(["---"] * (len(swept) + 3 + len(names)))]
    for number, r in enumerate(good):
        cells = [*r.keys.values(), f"{r.window_s:.3g}", f"{r.wall_s:.3g}", f"{r.peak_mb:.0f}",
                 *(_shown(r.errors[n]) if n in r.errors else "" for n in names)]
        lines.append(table_row([f"**{cell}**" for cell in cells] if number in best else cells))
    lines += [table_row([*r.keys.values(), r.status]) for r in results if r.status != "ok"]
    lines += [line for r in results for warning in r.warnings
              for line in ("", f"{' '.join(f'{k}={v}' for k, v in r.keys.items())} warns: {warning}")]
    if others:
        lines += ["", table_row(["others", "time [s]", *names]), table_row(["---"] * (2 + len(names)))]
        lines += [table_row([row["label"], f"{row['time_s']:.3g}",
                             *(_shown(row[f"error_{n}"]) if f"error_{n}" in row else "" for n in names)])
                  for row in others]
        lines += _comparison(good, others, names[0])
    return "\n".join(lines) + "\n"


def _comparison(good: List[sweep.Result], others: Sequence[dict], name: str) -> List[str]:
    """A sentence for each of the others: how much faster the case is at their error in ``name``."""
    lines = []
    for label, rows in list(_series("", good, others, ()))[1:]:
        ratios = speed_up([r.window_s for r in good], [r.errors.get(name, inf) for r in good],
                          [time for time, _, _ in rows], [errors.get(name, inf) for _, errors, _ in rows])
        if ratios:
            lines += ["", f"With at most the error in {name} of {label}'s best runs ("
                      + ", ".join(_shown(error) for error, _ in ratios) + ") the case is "
                      + ", ".join(f"{ratio:.0f}" for _, ratio in ratios) + " times as fast."]
    return lines


def _shown(error: float) -> str:
    """An error as a percentage; whole numbers are counts, and stay."""
    return f"{error:.0f}" if error == int(error) else f"{error:.2%}"


def speed_up(times: Sequence[float], errors: Sequence[float], other_times: Sequence[float],
             other_errors: Sequence[float]) -> List[Tuple[float, float]]:
    """How many times faster than the others at an equal or smaller error: for each point of their front that
    can be compared, (their error, their time over ours)."""
    ratios = []
    for i in figure.front(other_times, other_errors):
        ours = [t for t, e in zip(times, errors) if e <= other_errors[i]]
        if ours:
            ratios.append((other_errors[i], other_times[i] / min(ours)))
    return ratios


if __name__ == "__main__":
    sweep.end(main)
