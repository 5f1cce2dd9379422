"""Where compiled kernels are kept: a folder for each state of the sources and of the software that compiles them.

Numba's own cache looks at the file of the outermost function only. Here the name of the folder is a hash of all rooms that have
kernels, so an edit in any of them leads to another folder. The folder lies beside the package if that is writable, or below
NUMBA_CACHE_DIR if that is set; otherwise in the user's cache folder.
"""

import contextlib
import fcntl
import functools
import hashlib
import logging
import os
import platform
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

PACKAGE = Path(__file__).parents[1]

MARK = "\n@kernel\n"
"""What a room with kernels has in one of its files."""

KEPT_VERSIONS = 4
"""Number of folders that are kept in a place, so that environments that share it do not remove each other's."""


@dataclass(frozen=True)
class Entry:
    """The stored machine code of one kernel.

    Attributes:
        folder: Where it is.
        present: Whether there is any.
        writable: Whether it can be read or written there; if not, the kernel is compiled anew in every process.
    """

    folder: Path
    present: bool
    writable: bool

    @contextlib.contextmanager
    def in_use(self) -> Iterator[None]:
        """A context in which Numba takes this folder for the functions that it wraps."""
        from numba import config

        before = config.CACHE_DIR
        config.CACHE_DIR = str(self.folder)
        try:
            yield
        finally:
            config.CACHE_DIR = before

    def discard(self) -> None:
        """Remove what is stored."""
        for path in self.folder.glob("*/*.nb[ic]"):
            path.unlink(missing_ok=True)


@contextlib.contextmanager
def entry(name: str) -> Iterator[Entry]:
    """A context with the entry of a kernel; it is locked as long as it is empty, so that two processes do not both compile.

    Args:
        name: A name that is unique to the kernel.
    """
    folders = [place / key() / name for place in places()]
    found = next((folder for folder in folders if _stored(folder)), None)
    folder = found if found and os.access(found, os.W_OK) else next((folder for folder in folders if _made(folder)), None)
    if found and folder:
        if folder != found:  # Numba takes only folders that are writable; that of an installation may not be
            shutil.copytree(found, folder, dirs_exist_ok=True)
        yield Entry(folder, True, True)
        return
    if folder is None:
        logging.getLogger(__name__).warning("warning: compiled kernels cannot be kept: %s is not writable", places()[-1])
        yield Entry(Path(tempfile.gettempdir()), False, False)
        return
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Entry(folder, _stored(folder), True)
    _remove_stale(folder.parent)


def is_stored(name: str) -> bool:
    """Whether a kernel has an entry that is not empty."""
    return any(_stored(place / key() / name) for place in places())


def places() -> list[Path]:
    """The folders that may hold compiled kernels, in order of preference."""
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(given) / "vessel_hsmc_ros"]
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return [Path(__file__).parent / "__pycache__" / "kernels", user / "vessel_hsmc_ros" / "kernels"]


@functools.cache
def key() -> str:
    """A hash of the sources of all kernels and of the software and the processor on which the machine code depends."""
    from llvmlite import binding

    digest = hashlib.sha256()
    versions = (version(name) for name in ("numba", "llvmlite", "numpy"))
    # With the path: Numba finds stored code by that of the source file, and a copied tree must not look as if it had any.
    for text in (str(PACKAGE), platform.python_version(), *versions, binding.get_host_cpu_name()):
        digest.update(f"{text}\n".encode())
    for path in sources():
        digest.update(str(path.relative_to(PACKAGE.parent)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def sources() -> list[Path]:
    """All files of the rooms that have kernels.

    Not only those with kernels: the types of their arguments and their constants come from others. Machine code reads the fields
    of a type by their position, so code that is older than the type computes garbage or writes out of bounds.
    """
    rooms = sorted(path for path in PACKAGE.iterdir() if path.is_dir())
    files = [sorted(room.rglob("*.py")) for room in rooms]
    return [path for room in files if any(MARK in each.read_text(encoding="utf-8") for each in room) for path in room]


def _stored(folder: Path) -> bool:
    return any(folder.glob("*/*.nbi"))


def _made(folder: Path) -> bool:
    """Whether a folder exists or could be created, and is writable."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _remove_stale(present: Path) -> None:
    """Remove the folders of earlier sources from a place, but for the latest."""
    with contextlib.suppress(OSError):
        os.utime(present)
        others = [path for path in present.parent.iterdir() if path != present]
        for stale in sorted(others, key=lambda path: path.stat().st_mtime)[: -(KEPT_VERSIONS - 1)]:
            shutil.rmtree(stale, ignore_errors=True)
