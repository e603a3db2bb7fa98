"""What README and the pages in docs promise: links lead somewhere, the scene shown is the one that is
tested."""
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
LINK = re.compile(r"\]\(([^)#]+)[^)]*\)|src=\"([^\"]+)\"")
FILE = re.compile(r"`((?:mpm_fenicsx|dem_liggghts|coupling|cases|tests|docs)/[\w/.]*\w)`")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    targets = [a or b for a, b in LINK.findall(page.read_text(encoding="utf-8"))]
    missing = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page):
    missing = {name for name in FILE.findall(page.read_text(encoding="utf-8")) if not (ROOT / name).exists()}
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_images_have_alternative_texts(page):
    text = page.read_text(encoding="utf-8")
    shown = re.findall(r"!\[([^\]]*)\]\(([^)]*)\)", text)
    shown += [("".join(re.findall(r"\balt=\"([^\"]*)\"", tag)), tag)
              for tag in re.findall(r"<img\b[^>]*>", text)]
    assert not [where for alternative, where in shown if len(alternative.split()) < 2]


def test_readme_is_short_and_shows_the_scene_that_is_tested():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(readme.splitlines()) <= 120
    assert f"```python\n{(ROOT / 'docs/own_scene.py').read_text(encoding='utf-8')}```" in readme


def test_the_law_that_is_shown_is_the_one_that_is_tested():
    page, file = ((ROOT / f"docs/own_law.{kind}").read_text(encoding="utf-8") for kind in ("md", "py"))
    start = file.index("class Params")
    assert f"```python\n{file[start:file.index('# ---', start)].strip()}\n```" in page


def test_the_energy_that_is_shown_is_the_one_that_is_tested():
    names = "own_law.md", "energy_law.py"
    page, file = ((ROOT / "docs" / name).read_text(encoding="utf-8") for name in names)
    start = file.index("def mooney_rivlin")
    assert f"```python\n{file[start:file.index('# ---', start)].strip()}\n```" in page


def test_the_index_names_all_pages():
    index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    assert not [page.name for page in PAGES[2:] if page.name != "README.md" and f"({page.name})" not in index]


def test_the_glossary_is_sorted():
    rows = re.findall(r"^\| ([^|]+) \|", (ROOT / "docs/glossary.md").read_text(encoding="utf-8"), re.M)[2:]
    assert rows == sorted(rows, key=str.lower)


def test_numbers_of_the_validation_stand_where_they_come_from():
    """In the test or case that the row names, or in a page that is linked or names that: so a number that
    changes there is not forgotten here. Those with a point or a power only; others stand anywhere."""
    texts = {path: path.read_text(encoding="utf-8") for folder in ("docs", "tests", "cases")
             for path in (ROOT / folder).rglob("*.*") if path.suffix in (".md", ".py")}
    page, by, lost = texts.pop(ROOT / "docs/validation.md"), "", []
    for row in re.findall(r"^\| (?!---|quantity)(.+) \|$", page, re.M):
        found, named = re.split(r" *\| *", row)[2:4]
        by = by if named.startswith("the same") else named
        sources = {a or b for a, b in re.findall(r"(\w+\.py)\b|\]\((\w+\.md)", found + by)}
        stems = {name.removeprefix("test_").removesuffix(".py") for name in sources}
        there = "".join(text for path, text in texts.items() if path.name in sources or path.suffix == ".md"
                        and any(name in text for name in sources | stems))
        lost += [(number, row) for number in re.findall(r"(?<![\w.])\d+(?:\.\d+(?:e-?\d+)?|e-\d+)", found)
                 if not re.search(rf"(?<![\d.]){re.escape(number)}(?!\d|\.\d)", there)]
    assert sources and not lost
