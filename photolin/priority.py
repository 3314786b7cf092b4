"""Threads that let others go first, where the system has priorities of threads; else nothing."""

import os
import sys
from contextlib import suppress
from threading import get_native_id

LOWER = 10
"""Steps of niceness: a tenth of the processor where both it and a usual thread could use it."""


def lower_priority() -> None:
    """Let other threads go first from now on; the thread that calls it cannot take this back.

    Nor can those that it starts: they inherit it, and may call this again.
    """
    if sys.platform == "linux":  # elsewhere it would be all threads of the program
        thread = get_native_id()
        with suppress(OSError):  # work goes on as well where a sandbox forbids it
            usual = os.getpriority(os.PRIO_PROCESS, os.getpid())  # that of the first thread
            own = os.getpriority(os.PRIO_PROCESS, thread)
            os.setpriority(os.PRIO_PROCESS, thread, max(own, usual + LOWER))
