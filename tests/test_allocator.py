"""Memory that is free goes back to the system, where the C library can be told to."""

import ctypes
import subprocess
import sys

import pytest

from photolin import allocator as module
from photolin.allocator import ARENAS, give_back, use_few_arenas

glibc = pytest.mark.skipif(
    module._glibc("malloc_trim") is None, reason="the C library is not glibc"
)

HOLD = """
from pathlib import Path
from photolin.allocator import give_back
def resident():
    return int(Path("/proc/self/status").read_text().split("VmRSS:")[1].split()[0]) / 1024
before = resident()
many = [bytes(1000) for _ in range(200_000)]
last = many[-1]
del many
held = resident()
give_back()
print(held - before, resident() - before)
"""
COUNT = """
import ctypes, threading
from photolin.allocator import use_few_arenas
if {few}:
    use_few_arenas()
libc = ctypes.CDLL(None)
libc.malloc.restype = libc.fopen.restype = ctypes.c_void_p
libc.malloc_info.argtypes = (ctypes.c_int, ctypes.c_void_p)
libc.fclose.argtypes = (ctypes.c_void_p,)
meet = threading.Barrier(8)
def work():
    meet.wait()
    libc.malloc(1000)
    meet.wait()
threads = [threading.Thread(target=work) for _ in range(8)]
[t.start() for t in threads]
[t.join() for t in threads]
file = libc.fopen(b"/dev/stdout", b"w")
libc.malloc_info(0, file)
libc.fclose(file)
"""


def run(program: str) -> str:
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@glibc
def test_what_is_free_between_what_is_used_is_given_back() -> None:
    held, left = map(float, run(HOLD).split())
    assert held > 150
    assert left < 20


@glibc
def test_threads_share_few_arenas_once_they_are_told_to() -> None:
    few, many = (run(COUNT.format(few=few)).count("<heap nr=") for few in (True, False))
    assert few <= ARENAS < many


def test_nothing_is_called_where_the_c_library_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(ctypes, "CDLL", None)
    use_few_arenas()
    give_back()


def test_a_c_library_without_the_functions_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    use_few_arenas()
    give_back()
