"""Pages of the site that are made from the code: the keys of cases and studies, from what ``--help`` prints,
the public names of the packages, and the functions behind the formulas. Prints path → Markdown as JSON.

    python docs/site/made.py
"""
import importlib
import inspect
import json
import re
import sys
from pathlib import Path
from typing import Dict, List, Tuple

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PACKAGES = ("coupling", "mpm_fenicsx", "dem_liggghts")
CASES = sorted(path.stem for path in (ROOT / "cases").glob("*.py"))
UNIT = re.compile(r"\s*\[([^\]]+)\]")
STUDIES = ROOT / "cases/studies"
FUNCTION = re.compile(r"\]\(\.\./((?:coupling|mpm_fenicsx|dem_liggghts)/[\w/]+)\.py#([\w.]+)\)")
SOURCE = re.compile(r"(?<![\w/])(docs/\w+\.md)")
HEAD = "| key | default | unit | meaning |", "| --- | --- | --- | --- |"
USUAL = {"scheme": "Windows, steps and the scheme of coupling", "numerics": "Numerics of the soil or solid",
         "state": "The soil at the start", "output": "What the run leaves"}


def row(name: str, default: str, meaning: str) -> str:
    """A key as a row of its table; the unit is what stands in brackets in its meaning."""
    unit = UNIT.search(meaning)
    meaning = UNIT.sub("", meaning, count=1).lstrip("; ") if unit else meaning
    meaning = SOURCE.sub(r"[\1](../\1)", meaning.replace("|", "\\|").replace("<", "&lt;"))
    words = (f"`{name}`", f"`{default}`", unit.group(1) if unit else "", meaning)
    return f"| {' | '.join(words)} |"


def tables(case) -> List[str]:
    """One table for the keys of the case itself, one for each group that it shares with others."""
    from coupling.cli import described

    groups: Dict[str, list] = {"": []}
    for name, key in case.keys.items():
        group = "" if key.argument == name else key.argument
        groups.setdefault(group, []).append(row(name, *described(key)))
    lines = []
    for argument, rows in groups.items():
        title = USUAL.get(argument, f"Of the {argument}") if argument else "Of the case itself"
        if rows:
            lines += ["", f"## {title}", "", *HEAD, *rows]
    return lines


def presets(case) -> List[str]:
    """The named sets of keys."""
    from coupling.cli import typed

    if not case.presets:
        return []
    words = {name: " ".join(f"{key}={typed(value)}" for key, value in keys.items())
             for name, keys in case.presets.items()}
    rows = [f"| `preset={name}` | `{given}` |" for name, given in words.items()]
    return ["", "## Presets", "", "| | stands for |", "| --- | --- |", *rows]


def page(name: str) -> Tuple[str, str]:
    """Path and text of the page of a case: what it is, how it is called, its keys."""
    module = importlib.import_module(name)
    sentence, _, usage = module.__doc__.strip().partition("\n\n")
    results = re.search(rf"`cases/{name}\.py`.*\(\[results\]\((docs/[^)]+)\)\)", README)
    text = [f"# {name}", "", " ".join(sentence.split()), "", usage, "", inspect.getdoc(module.main),
            f"[Results](../{results.group(1)}).", "",
            "An unknown key, or a value out of its range, is refused with a sentence. Options with a dash "
            "are PETSc's. How a case is run, and what it leaves: [running a case](../docs/running.md)."]
    return f"cases/{name}.md", "\n".join([*text, *tables(module.main), *presets(module.main), ""])


def api(package: str) -> Tuple[str, str]:
    """Path and text of the page of a package: each public name where it is defined, as griffe reads it."""
    module = importlib.import_module(package)
    places = []
    for name in module.__all__:
        thing = getattr(module, name)
        if inspect.ismodule(thing):
            places.append(thing.__name__)
        elif inspect.isclass(thing) or inspect.isfunction(thing):
            places.append(f"{thing.__module__}.{thing.__qualname__}")
        else:
            places.append(f"{package}.{name}")
    text = [f"# {package}", inspect.getdoc(module), f"`from {package} import …`"]
    return f"api/{package}.md", "\n\n".join([*text, *(f"::: {place}" for place in places), ""])


def place_of(file: str, name: str) -> str:
    """Full name of what a link to ``file.py#name`` means.

    >>> place_of("coupling/maps/mapping", "Mapping.force")
    'coupling.maps.mapping.Mapping.force'
    """
    return f"{file.replace('/', '.')}.{name}"


def formulas() -> Tuple[str, str]:
    """The page of the functions to which pages link where they have their formulas, with their code."""
    found = {pair for path in (ROOT / "docs").glob("*.md")
             for pair in FUNCTION.findall(path.read_text(encoding="utf-8"))}
    text = ["# Functions behind the formulas",
            "What the pages of theory link to: each function with its docstring and its code. Names that are "
            "in none of the packages' `__all__` may change from version to version."]
    last = ""
    for file, name in sorted(found):
        if file != last:
            text.append(f"## {file.replace('/', '.')}")
        last = file
        text.append(f"::: {place_of(file, name)}\n    options:\n      show_source: true\n"
                    "      heading_level: 3\n      members: false")
    return "api/formulas.md", "\n\n".join([*text, ""])


def study(path: Path) -> Tuple[str, str]:
    """Path and text of the page of a study that is called from the command line: what it is and how it is
    called, with its keys; of a study of scenes, those of each scene."""
    name = path.relative_to(STUDIES).with_suffix("").as_posix()
    module = importlib.import_module(f"studies.{name.replace('/', '.')}")
    title = name.split("/")[0]
    text = [f"# {title}", "", module.__doc__.strip()]
    main = module.main
    if hasattr(main, "keys"):
        text += tables(main)
    elif "/" in name:
        text += ["", "## Scenes", "", "Keys of a scene are arguments of its `run`; in a sweep they take the "
                 "values of its `SWEEP`.", *sum(map(scene, sorted(path.parent.glob("*.py"))), [])]
    return f"studies/{title}.md", "\n".join([*text, ""])


def scene(path: Path) -> List[str]:
    """One scene of a study: what it is, the keys of its ``run``, their defaults; nothing for helpers."""
    module = importlib.import_module(f"studies.{path.parent.name}.{path.stem}")
    if not hasattr(module, "SWEEP") and not hasattr(module, "MEASURE"):
        return []
    keys = [key for key in inspect.signature(module.run).parameters.values()
            if key.default is not inspect.Parameter.empty]
    rows = [f"| `{key.name}` | `{key.default}` |" for key in keys]
    return ["", f"### {path.stem}", "", module.__doc__.strip(), "", inspect.getdoc(module.run), "",
            "| key | default |", "| --- | --- |", *rows]


def studies() -> Dict[str, str]:
    """A page of each study that is called from the command line."""
    called = [path for path in sorted(STUDIES.rglob("*.py"))
              if 'if __name__ == "__main__":' in path.read_text(encoding="utf-8")]
    return dict(map(study, called))


def pages() -> Dict[str, str]:
    """All of them, and the page that lists the cases: the table of README."""
    table = re.search(r"^## Cases\n(.*?)^## ", README, re.M | re.S).group(1)
    table = re.sub(r"src=\"|\]\((?=\w)", lambda found: found.group() + "../", table)
    table = re.sub(r"`cases/(\w+)\.py`", r"[`\1`](\1.md)", table)
    made = {"cases/index.md": f"# Cases\n{table}"}
    return {**made, **dict(map(page, CASES)), **dict(map(api, PACKAGES)), **dict([formulas()]), **studies()}


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "cases")]
    json.dump(pages(), sys.stdout)
