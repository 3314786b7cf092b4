"""How a program holds its memory, where the C library is glibc; elsewhere nothing is done.

glibc keeps what threads free, up to 8 arenas for each processor, for later: a program that works on
pictures for hours holds several times what it uses. See `man 3 mallopt` and `malloc_trim`.
"""

import ctypes
import gc
import sys
from typing import Any

M_ARENA_MAX = -8
"""Number of the parameter in <malloc.h>."""
ARENAS = 2


def use_few_arenas() -> None:
    """Let all threads share their free memory; to be called before they are started."""
    if (mallopt := _glibc("mallopt")) is not None:
        mallopt(M_ARENA_MAX, ARENAS)


def give_back() -> None:
    """Give free memory back to the system, garbage too; takes about a tenth of a second."""
    gc.collect()
    if (trim := _glibc("malloc_trim")) is not None:
        trim(0)


def _glibc(name: str) -> Any:
    """A function of the C library; None where it has none of that name."""
    if not sys.platform.startswith("linux"):
        return None
    return getattr(ctypes.CDLL(None), name, None)
