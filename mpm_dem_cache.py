"""Where compiled kernels are kept when neither the source tree nor the user's own cache can be written.

numba, and matplotlib with its fonts, keep what costs seconds to make; without a place numba refuses to
compile at all. A user without a home who runs a program installed by another one gets a folder of his own
among the temporary files. The packages import this before anything else.
"""
import os
import stat
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent
PACKAGES = "mpm_fenicsx", "dem_liggghts", "coupling"


def writable(folder):
    """Can files be made in ``folder``, or the folder itself?"""
    folder = Path(folder)
    if not folder.is_absolute():  # of a user without a home
        return False
    while not folder.exists():
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def folders():
    """Of this project's packages and cases, with those inside them: there lie compiled functions."""
    scripts = "cases", "mpm_dem_cases"  # in the source tree, installed
    inner = [path.parent for name in (*PACKAGES, *scripts) for path in (ROOT / name).glob("*/__init__.py")]
    return [*(ROOT / name for name in PACKAGES), *inner]


def home(variable, default):
    """The user's folder for one kind of files, as freedesktop.org defines it."""
    return Path(os.environ.get(variable) or os.path.expanduser(f"~/{default}"))


def own_folder():
    """Among the temporary files, for this user alone: what is loaded from there is run. Where somebody else
    has made one of that name it lasts as long as the process."""
    place = Path(tempfile.gettempdir(), f"mpm-dem-{os.getuid()}")
    try:
        place.mkdir(mode=0o700, exist_ok=True)
        found = place.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not stat.S_IMODE(
                found.st_mode) & 0o077:
            return place
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="mpm-dem-"))


def choose():
    """Set NUMBA_CACHE_DIR and MPLCONFIGDIR where nobody has and the usual places cannot be written."""
    kernels = "NUMBA_CACHE_DIR" in os.environ or all(writable(folder / "__pycache__") for folder in folders())
    if not (kernels or writable(home("XDG_CACHE_HOME", ".cache") / "numba")):
        os.environ["NUMBA_CACHE_DIR"] = str(own_folder())
        if "numba" in sys.modules:
            sys.modules["numba"].config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]
    if not ("MPLCONFIGDIR" in os.environ or writable(home("XDG_CONFIG_HOME", ".config") / "matplotlib")):
        os.environ["MPLCONFIGDIR"] = str(own_folder())


choose()
