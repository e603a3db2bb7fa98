"""All scenes of this folder, or those named, with each basis: a table, its CSV, error against run time.

    python -m coupling.crossing                           all scenes; results in out/crossing
    python -m coupling.crossing bar step                  these scenes
    python -m coupling.crossing bar basis=linear,gimp+tpic out=out/bar
    python -m coupling.crossing into=docs/basis.md        and the table of that page, and its figure beside it

A scene is a module with ``run(basis=…, …)``, which returns numbers by name: errors, and ``newton``
iterations per step, ``step_ms``, the median, and ``seconds``. It may name its ``SWEEP``, a list of
arguments for ``run``, coarse first, and the ``MEASURE`` that the figure shows; without them it is run
once as it is, and its first number is shown. One with ``ONLY_BY_NAME = True`` is run only when it is
named. A basis may have a transfer, ``gimp+tpic``, in scenes whose ``run`` takes one (``transfer``, or
any ``others``). A run that fails is a row with its reason. What is in ``out`` already is not run again:
remove the folder after a change of the program.
"""
import csv
import importlib
import inspect
import json
import re
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence

import mpm_dem_checks as check
from coupling import cli
from coupling.pictures import figure
from coupling.records.report import table_row
from coupling.records.writing import tell
from studies import sweep

COST = ("newton", "step_ms", "seconds")
HELPERS = ("__init__", "common", "table")
BLOCK = re.compile(r"(<!-- crossing: [^>]*-->\n).*?(\n<!-- end of crossing -->)", re.S)
WAYS = "linear,gimp,gimp+tpic,ugimp"
STYLES = {"linear": ("C0", "o"), "ugimp": ("C1", "s"), "gimp": ("C2", "D"), "gimp+tpic": ("C4", "d"),
          "bspline": ("C3", "^"), "bspline+tpic": ("C3", "v")}


class Row(NamedTuple):
    """One run: scene, basis (with a plus and the transfer where it is not the default one), arguments of
    ``run``, what it returned, and why it failed, or ""."""

    scene: str
    basis: str
    given: Dict[str, Any]
    found: Dict[str, float]
    failure: str = ""


def scenes() -> List[str]:
    """Names of the scenes that there are."""
    return sorted(path.stem for path in Path(__file__).parent.glob("*.py") if path.stem not in HELPERS)


def default_scenes() -> List[str]:
    """Those of them that are run unless others are named."""
    return [name for name in scenes()
            if not getattr(importlib.import_module(f"studies.crossing.{name}"), "ONLY_BY_NAME", False)]


def run(name: str, basis: str) -> List[Row]:
    """The sweep of a scene with one basis; nothing for a transfer that the scene does not take."""
    module, rows = importlib.import_module(f"studies.crossing.{name}"), []
    kind, _, transfer = basis.partition("+")
    more = {"transfer": transfer} if transfer else {}
    takes = inspect.signature(module.run).parameters
    if more and not ({"transfer", "others"} & set(takes)):
        return []
    sizes = getattr(module, "SWEEP", [{}])
    for given in [sizes[0], *sizes]:  # the first once more, as kernels are compiled in it
        try:
            found = module.run(basis=kind, **given, **more)
        except (ArithmeticError, RuntimeError, ValueError) as error:
            rows.append(Row(name, basis, given, {}, str(error).splitlines()[0]))
        else:
            rows.append(Row(name, basis, given, {k: float(v) for k, v in found.items() if _is_number(v)}))
    for row in rows[1:]:
        tell(_line(row))
    return rows[1:]


def kept(path: Path, name: str, basis: str) -> List[Row]:
    """What ``run`` returns, from the file ``path`` where it has been run before, else kept there."""
    if path.is_file():
        return [Row(**row) for row in json.loads(path.read_text())]
    rows = run(name, basis)
    path.write_text(json.dumps([row._asdict() for row in rows]))
    return rows


def _is_number(value: Any) -> bool:
    return not isinstance(value, (str, dict, list, tuple)) and value is not None


def measure(rows: Sequence[Row]) -> str:
    """The number that the figure shows of a scene's rows, "" when all of them failed."""
    names = [name for row in rows for name in row.found if name not in COST] or [""]
    return getattr(importlib.import_module(f"studies.crossing.{rows[0].scene}"), "MEASURE", names[0])


def _line(row: Row) -> str:
    head = " ".join([row.scene, row.basis, *(f"{k}={v}" for k, v in row.given.items())])
    return f"{head}: " + (row.failure or ", ".join(f"{k} {v:.4g}" for k, v in row.found.items()))


def markdown(rows: Sequence[Row]) -> str:
    """One table per scene, under its title."""
    lines: List[str] = []
    for name in dict.fromkeys(row.scene for row in rows):
        own = [row for row in rows if row.scene == name]
        names = list(dict.fromkeys(k for row in own for k in row.found if k not in COST))
        given = list(dict.fromkeys(k for row in own for k in row.given))
        head = ["basis", *given, *names, "Newton per step", "step [ms]", "all steps [s]"]
        lines += ["", f"**{title(name)}**", "", table_row(head), table_row(["---"] * len(head))]
        for row in own:
            cells = [f"{row.found[k]:.4g}" if k in row.found else "" for k in [*names, *COST]]
            if row.failure:
                cells[0] = f"stopped: {row.failure}"
            lines.append(table_row([row.basis, *(str(row.given.get(k, "")) for k in given), *cells]))
    return "\n".join(lines[1:]) + "\n"


def title(name: str) -> str:
    """What the docstring of a scene says before its first colon or full stop."""
    text = importlib.import_module(f"studies.crossing.{name}").__doc__ or name
    return re.split(r"[:.]", " ".join(text.split()), maxsplit=1)[0]


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """A line per run and number: scene, basis, arguments, name, value; a failure as the name "stopped"."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        out = csv.writer(file)
        out.writerow(["scene", "basis", "given", "name", "value"])
        for row in rows:
            given = " ".join(f"{k}={v}" for k, v in row.given.items())
            pairs = {"stopped": row.failure} if row.failure else row.found
            out.writerows([row.scene, row.basis, given, name, value] for name, value in pairs.items())


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Error against run time, a panel per scene, a curve per basis."""
    names = list(dict.fromkeys(row.scene for row in rows if row.found))
    columns = min(3, len(names))
    plt, height = figure.pyplot(), -(-len(names) // columns)
    picture, axes = plt.subplots(height, columns, figsize=(4.3 * columns, 3.4 * height), squeeze=False)
    for axis, name in zip(axes.flat, names):
        own = [row for row in rows if row.scene == name and row.found]
        shown = measure(own)
        for basis in dict.fromkeys(row.basis for row in own):
            at = [(row.found["seconds"], abs(row.found[shown])) for row in own if row.basis == basis]
            colour, marker = STYLES.get(basis, ("C5", "v"))
            axis.loglog(*zip(*at), color=colour, marker=marker, markersize=5, label=basis)
        axis.set_title(title(name), fontsize="small")
        axis.set(xlabel="time in steps [s]", ylabel=shown)
        axis.margins(0.15)
        axis.grid(alpha=0.3, which="both")
        axis.tick_params(which="both", labelsize=7)
    for axis in axes.flat[len(names):]:
        axis.set_axis_off()
    picture.tight_layout(rect=(0, 0, 1, 1 - 0.3 / (3.4 * height)))
    curves = [line for axis in axes.flat for line in axis.get_lines()]
    known = {line.get_label(): line for line in curves}
    picture.legend(known.values(), known.keys(), loc="upper center", ncol=len(known), frameon=False)
    picture.savefig(path, dpi=110)
    plt.close(picture)


def main(words: List[str]) -> int:
    """What the words of the command line ask for; returns the exit status."""
    if {"-h", "--help"} & set(words):
        tell(__doc__)
        return 0
    keys = dict(word.split("=", 1) for word in words if "=" in word)
    if unknown := set(keys) - {"basis", "out", "into"}:
        raise cli.UsageError(f"unknown key {sorted(unknown)[0]!r}: there are basis, out and into")
    named = [word for word in words if "=" not in word]
    for name in named:
        cli.checked(check.choice, "scene", name, choices=tuple(scenes()))
    out = cli.checked(check.path, "out", keys.get("out", "out/crossing"))
    out.mkdir(parents=True, exist_ok=True)
    rows = [row for name in named or default_scenes() for basis in keys.get("basis", WAYS).split(",")
            for row in kept(out / f"{name}_{basis}.json", name, basis)]
    write_csv(out / "crossing.csv", rows)
    (out / "crossing.md").write_text(markdown(rows), encoding="utf-8")
    draw(out / "crossing.png", rows)
    if "into" in keys:
        page = cli.checked(check.path, "into", keys["into"])
        text = page.read_text(encoding="utf-8")
        page.write_text(BLOCK.sub(lambda m: f"{m[1]}\n{markdown(rows)}{m[2]}", text), encoding="utf-8")
        draw(page.with_suffix(".png"), rows)
    tell(f"table, CSV and figure in {out}")
    return 0 if any(row.found for row in rows) else 1


if __name__ == "__main__":
    sweep.end(main)
