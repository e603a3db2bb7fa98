"""Pages of the site, for MkDocs: the Markdown files where they lie in the repository, so that their links
lead where they lead on the repository's page, what they link to, and pages made from the code."""
import json
import os
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from mkdocs.structure.files import File, Files
from mkdocs.utils import get_relative_url

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "docs/site"))

from made import FUNCTION, place_of  # noqa: E402
from notebook import page, run  # noqa: E402

NOTEBOOKS = ["docs/plane_scene.ipynb"]
LINK = re.compile(r"\]\(([^)#\s]+)|src=\"([^\"]+)\"")
NOTEBOOK = re.compile(r"\]\(([^)]+\.ipynb)\)")
MATHJAX = "assets/mathjax/tex-svg.js"  # all in one file: draws formulas without fonts and without a network
SCRIPT = """<script>MathJax = {tex: {inlineMath: [["\\\\(", "\\\\)"]], displayMath: [["\\\\[", "\\\\]"]]},
options: {ignoreHtmlClass: ".*", processHtmlClass: "arithmatex"}}</script>
<script async src="%s"></script>
</head>"""


def on_files(files, config):
    """In place of the folder that MkDocs has read: the repository's pages and all that they show."""
    docs = Path(config.docs_dir)
    kept = [file for file in files if file.abs_src_path is None
            or docs not in Path(file.abs_src_path).parents]  # of the theme
    pages = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(docs.glob("*.md"))]
    shown = {ROOT / "docs/site/style.css"}.union(*map(_linked, pages))
    paths = [path.relative_to(ROOT).as_posix() for path in [*pages, *sorted(shown - set(pages))]]
    kept += [File(path, str(ROOT), config.site_dir, config.use_directory_urls) for path in paths]
    mathjax = Path(find_spec("mathjax").origin).parent / "static/mathjax/es5/tex-svg.js"
    kept.append(File.generated(config, MATHJAX, abs_src_path=str(mathjax)))
    for path in NOTEBOOKS:
        kept += _run(path, config)
    return Files(kept + [File.generated(config, path, content=text) for path, text in _made().items()])


def _linked(page):
    """Files that a page links to or shows, but for those whose functions are on a page of their own."""
    text = FUNCTION.sub("](", page.read_text(encoding="utf-8"))
    targets = [one or other for one, other in LINK.findall(text)]
    return {path for target in targets if "://" not in target
            and (path := (page.parent / target).resolve()).is_file()}


def _run(path, config):
    """A notebook as a page, with what its cells print and draw, and the notebook itself."""
    name = (ROOT / path).stem
    with tempfile.TemporaryDirectory() as folder:
        text, pictures = page(run(ROOT / path, Path(folder)), name)
    files = {f"docs/{name}.md": text, **{f"docs/{file}": picture for file, picture in pictures.items()}}
    return [File.generated(config, uri, content=content) for uri, content in files.items()]


def on_page_markdown(markdown, page, **_):
    """Links that lead to a function in a file of the repository lead to its place on the page of functions,
    those to a notebook to its page."""
    uri = page.file.src_uri
    functions = os.path.relpath("api/formulas.md", os.path.dirname(uri))
    markdown = FUNCTION.sub(lambda found: f"]({functions}#{place_of(*found.groups())})", markdown)
    own = {Path(path).name for path in NOTEBOOKS if Path(path).with_suffix(".md").as_posix() == uri}
    return NOTEBOOK.sub(lambda found: found.group() if found.group(1) in own else
                        f"]({found.group(1)[:-6]}.md)", markdown)


def _made():
    """In a process of its own: the cases start MPI, and PETSc reads the command line."""
    done = subprocess.run([sys.executable, ROOT / "docs/site/made.py"], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def on_post_page(output, page, config):
    """The script that draws formulas, where there are some."""
    if "class=\"arithmatex\"" not in output:
        return output
    return output.replace("</head>", SCRIPT % get_relative_url(MATHJAX, page.url), 1)
