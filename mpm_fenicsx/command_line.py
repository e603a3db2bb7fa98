"""The words of the command line, those with a dash for PETSc, and what PETSc is told besides."""
import sys
from typing import List

PETSC_DEFAULTS = {  # options of the whole process where the user gave none of that name
    "options_left": "no",  # `unused_options` says it; PETSc from 3.21 on would say it, too
    "vec_mdot_use_gemv": "no",  # round-off of the newer VecMDot depends on where vectors lie in memory
}


def words() -> List[str]:
    """Name of the script and its words. In a notebook the words are those of its kernel, and none of ours:
    options are given there as ``PETSc.Options()["mpm_…"] = …``, or in PETSC_OPTIONS."""
    return sys.argv[:1] if "ipykernel" in sys.modules else sys.argv
