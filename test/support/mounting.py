"""Small file systems for tests, where mounting is permitted."""

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

READ_ONLY, _DETACH = 1, 2


@contextmanager
def mounted(path: Path, megabytes: int, flags: int = 0) -> Iterator[Path]:
    """A file system in memory, mounted on a new folder; skips the test where mounting is not permitted."""
    libc = ctypes.CDLL(None, use_errno=True)
    path.mkdir()
    if libc.mount(b"tmpfs", os.fsencode(path), b"tmpfs", flags, f"size={megabytes}m".encode()):
        pytest.skip(f"a file system cannot be mounted here: {os.strerror(ctypes.get_errno())}")
    try:
        yield path
    finally:
        libc.umount2(os.fsencode(path), _DETACH)
