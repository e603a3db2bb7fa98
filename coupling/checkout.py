"""Studies of the cases that are called by a word of this package, ``python -m coupling.work_precision``."""
import runpy
import sys
from pathlib import Path

CASES = Path(__file__).parents[1] / "cases"


def run_study(name: str) -> None:
    """Run the file ``name``.py of cases/studies as the program; a sentence and status 1 where there is no
    checkout."""
    script = CASES / "studies" / f"{name}.py"
    if not script.is_file():
        sys.exit(f"error: {script} is not there: the studies belong to the cases, run this in a checkout of "
                 "the project")
    sys.path.insert(0, str(CASES))
    runpy.run_path(str(script), run_name="__main__")
