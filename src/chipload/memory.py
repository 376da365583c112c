"""Return of free memory to the system: what one phase of a run has freed does not add to the peak of the next."""

from __future__ import annotations

import ctypes
import sys


def return_free_memory() -> None:
    """Return the memory that the allocators of the C library and of Arrow keep for reuse; it changes no value.

    Where the C library has no ``malloc_trim`` (only glibc has it) it does nothing for that part.
    """
    arrow = sys.modules.get("pyarrow")
    if arrow is not None:
        arrow.default_memory_pool().release_unused()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(ctypes.c_size_t(0))
