"""The notebook of the documentation: run, cell by cell, and made a page of what its cells print and draw."""
import base64
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Tuple

TIMEOUT = 300  # [s] for a cell


def cells(path: Path) -> List[Dict[str, Any]]:
    """Of the notebook at ``path``, with their ``source`` as one text."""
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [{**cell, "source": "".join(cell["source"])} for cell in found]


def run(path: Path, folder: Path) -> Any:
    """The notebook with its outputs, run in a kernel of Jupyter in ``folder``. Needs the extra ``docs`` of
    pyproject.toml; an error in a cell is raised."""
    import nbformat
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as sockets:  # files in the place of ports
        kernel = AsyncKernelManager(kernel_name="python3", transport="ipc", ip=f"{sockets}/kernel")
        NotebookClient(notebook, km=kernel, timeout=TIMEOUT, startup_timeout=TIMEOUT,
                       resources={"metadata": {"path": str(folder)}}).execute()
    return notebook


def run_plainly(path: Path) -> str:
    """What its cells print, run one after the other in one namespace without Jupyter, whose magic is left
    out."""
    printed, names = io.StringIO(), {"__name__": "__main__"}
    with contextlib.redirect_stdout(printed):
        for cell in cells(path):
            if cell["cell_type"] == "code":
                lines = [line for line in cell["source"].splitlines() if not line.startswith("%")]
                exec(compile("\n".join(lines), cell["id"], "exec"), names)
    return printed.getvalue()


def printed(notebook: Any) -> str:
    """All that the cells of a notebook that has been run have printed, warnings included."""
    return "".join(output["text"] for cell in notebook.cells for output in cell.get("outputs", [])
                   if output["output_type"] == "stream")


def pictures(notebook: Any) -> List[Tuple[str, bytes]]:
    """Its pictures with their alternative texts, ``alt`` in the metadata of the cell."""
    return [(cell.metadata["alt"], base64.b64decode(output["data"]["image/png"])) for cell in notebook.cells
            for output in cell.get("outputs", []) if "image/png" in output.get("data", {})]


def page(notebook: Any, name: str) -> Tuple[str, Dict[str, bytes]]:
    """Markdown of a notebook that has been run, and its pictures: file name → PNG. name: of its file, without
    the ending."""
    parts, files = [], {}
    shown = iter(pictures(notebook))
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        said = "".join(output["text"] for output in cell.outputs if output["output_type"] == "stream")
        if said:
            parts.append(f"```text\n{said.strip()}\n```")
        for output in cell.outputs:
            if "image/png" in output.get("data", {}):
                alternative, picture = next(shown)
                file = f"{name}_{len(files) + 1}.png"
                files[file] = picture
                parts.append(f"![{alternative}]({file})")
    title, _, rest = "\n\n".join(parts).partition("\n")
    note = f"*This page is the notebook [{name}.ipynb]({name}.ipynb), run when the site was built.*"
    return f"{title}\n\n{note}\n{rest}\n", files
