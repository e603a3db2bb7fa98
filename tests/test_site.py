"""The pages of the documentation's site that are made from the code. That all links lead somewhere is checked
where it is built, by `./dev docs`."""
import ast
import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def made():
    done = subprocess.run([sys.executable, ROOT / "docs/site/made.py"], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


@pytest.mark.parametrize("case", ["beam_impact", "extreme", "terrain"])
def test_a_case_has_all_keys_of_its_help(case, made):
    told = subprocess.run([sys.executable, ROOT / f"cases/{case}.py", "--help"], check=True,
                          capture_output=True, text=True).stdout
    keys = re.findall(r"^  (\w+)=(?!\w+ +\w+=)", told, re.M)
    rows = re.findall(r"^\| `(\w+)` \| `", made[f"cases/{case}.md"], re.M)
    assert sorted(rows) == sorted(key for key in keys if key != "preset")


def test_a_row_has_default_unit_and_meaning(made):
    rows = made["cases/beam_impact.md"].splitlines()
    assert "| `E` | `215820000000` | Pa | Young's modulus |" in rows
    assert "| `v0` | `0.01` | m/s | impact speed |" in rows
    assert "| `law` | `linear` |  | of the beam; one of linear, neo_hooke |" in rows


@pytest.mark.parametrize("package", ["coupling", "dem_liggghts", "mpm_fenicsx"])
def test_the_api_shows_all_public_names(package, made):
    shown = [place.rpartition(".")[2] for place in re.findall(r"^::: (\S+)", made[f"api/{package}.md"], re.M)]
    assert shown == importlib.import_module(package).__all__


def test_the_site_has_all_pages(made):
    """MkDocs would say it, too, but needs PyPI."""
    listed = re.findall(r"[\w/]+\.md$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
    pages = ["README.md", "CHANGELOG.md", *(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))]
    notebooks = [f"docs/{path.stem}.md" for path in (ROOT / "docs").glob("*.ipynb")]
    assert sorted(listed) == sorted([*pages, *notebooks, *made])


def test_formulas_name_functions_that_exist(made):
    """Links such as ``../coupling/maps/mapping.py#Mapping.force``; each is on the page of functions."""
    links = {link for page in (ROOT / "docs").glob("*.md")
             for link in re.findall(r"\]\(\.\./([\w/]+)\.py#([\w.]+)\)", page.read_text(encoding="utf-8"))}
    assert len(links) > 60
    shown = re.findall(r"^::: (\S+)", made["api/formulas.md"], re.M)
    assert sorted(shown) == sorted(f"{file.replace('/', '.')}.{name}" for file, name in links)
    missing = [link for link in links if not _defined(ROOT / f"{link[0]}.py", link[1].split("."))]
    assert not missing


def _defined(file, names):
    body = ast.parse(file.read_text(encoding="utf-8")).body
    for name in names:
        found = [node for node in body if getattr(node, "name", None) == name]
        if not found:
            return False
        body = found[0].body
    return True


def test_studies_have_their_keys(made):
    assert "| `width` | `2` | m | of the flume |" in made["studies/plug.md"].splitlines()
    crossing = made["studies/crossing.md"]
    scenes = re.findall(r"^### (\w+)$", crossing, re.M)
    assert {"bar", "rolling", "spinning"} <= set(scenes) and not {"common", "table"} & set(scenes)
    assert "| `periods` | `10` |" in crossing
    assert "jobs=N" in made["studies/stability.md"] and "repeat=N" in made["studies/work_precision.md"]
