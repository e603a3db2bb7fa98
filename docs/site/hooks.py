"""Pages of the site, for MkDocs: the Markdown files where they lie in the repository, so that their links
lead where they lead on the repository's page, what they link to, and pages made from the code."""
import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from mkdocs.structure.files import File, Files
from mkdocs.utils import get_relative_url

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"\]\(([^)#\s]+)|src=\"([^\"]+)\"")
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
    return Files(kept + [File.generated(config, path, content=text) for path, text in _made().items()])


def _linked(page):
    """Files that a page links to or shows."""
    targets = [one or other for one, other in LINK.findall(page.read_text(encoding="utf-8"))]
    return {path for target in targets if "://" not in target
            and (path := (page.parent / target).resolve()).is_file()}


def _made():
    """In a process of its own: the cases start MPI, and PETSc reads the command line."""
    done = subprocess.run([sys.executable, ROOT / "docs/site/made.py"], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def on_post_page(output, page, config):
    """The script that draws formulas, where there are some."""
    if "class=\"arithmatex\"" not in output:
        return output
    return output.replace("</head>", SCRIPT % get_relative_url(MATHJAX, page.url), 1)
