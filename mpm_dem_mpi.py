"""Variables of the environment by which MPI tells a process that it is a rank."""
import os
import re
from typing import Dict

OF_MPI = re.compile("(OMPI|PMIX|PMI|PRTE|HYDRA|MPI)_")


def outside_mpi() -> Dict[str, str]:
    """Environment for a process that is no rank of the run that this process may be a rank of. What the user
    has allowed, to start ranks as root, stays."""
    return {name: text for name, text in os.environ.items()
            if not OF_MPI.match(name) or name.startswith("OMPI_ALLOW_")}
