"""Compiled loops find a place to be kept, whatever can be written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from photolin.kernels.cache import choose_cache

READ_ONLY = Path("/proc")


def test_a_writable_package_keeps_its_own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    choose_cache(tmp_path)
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_what_the_user_chose_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "elsewhere")
    choose_cache(READ_ONLY)
    assert os.environ["NUMBA_CACHE_DIR"] == "elsewhere"


def chosen(**environment: str) -> Path:
    """The folder chosen for a read-only package, in a process without numba."""
    code = (
        "import importlib.util as u, os, pathlib, sys\n"
        "s = u.spec_from_file_location('cache', sys.argv[1]); m = u.module_from_spec(s)\n"
        "s.loader.exec_module(m); m.os.access = lambda p, mode: str(p) != '/read-only' and "
        "os.path.isdir(p)\n"
        "m.choose_cache(pathlib.Path('/read-only')); print(os.environ['NUMBA_CACHE_DIR'])\n"
    )
    script = Path(__file__).parents[1] / "photolin" / "kernels" / "cache.py"
    kept = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", code, str(script)],
        env=kept | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return Path(done.stdout.strip())


def test_a_read_only_package_uses_the_users_cache(tmp_path: Path) -> None:
    assert chosen(XDG_CACHE_HOME=str(tmp_path)) == tmp_path / "photolin"


def test_without_any_home_a_private_folder_serves() -> None:
    folder = chosen(XDG_CACHE_HOME="/proc/nowhere")
    assert folder.is_dir()
    assert folder.stat().st_mode & 0o077 == 0
    folder.rmdir()
