"""The words of the command line, those with a dash for PETSc."""
import sys
from typing import List


def words() -> List[str]:
    """Name of the script and its words. In a notebook the words are those of its kernel, and none of ours:
    options are given there as ``PETSc.Options()["mpm_…"] = …``, or in PETSC_OPTIONS."""
    return sys.argv[:1] if "ipykernel" in sys.modules else sys.argv
