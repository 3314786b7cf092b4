"""Where compiled loops are kept between runs."""

import os
import sys
import tempfile
from pathlib import Path


def choose_cache(package: Path) -> None:
    """Give numba a folder it can write, before it is imported.

    By itself it takes the package's own folder or the user's cache folder and fails on import
    where it can write neither, as with a read-only installation and no home.
    """
    if os.environ.get("NUMBA_CACHE_DIR") or os.access(package, os.W_OK):
        return
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "photolin"
    try:
        user.mkdir(parents=True, exist_ok=True)
        folder = str(user) if os.access(user, os.W_OK) else ""
    except OSError:
        folder = ""
    # gone with the process: a folder of a known name in a shared place could be another user's
    folder = folder or tempfile.mkdtemp(prefix="photolin-")
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder
