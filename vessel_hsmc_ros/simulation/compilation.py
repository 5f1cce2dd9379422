"""Compiles kernels with Numba: the text that the nodes interpret, to machine code with bit-identical results.

float64 without fast-math: no operation is reordered, contracted or approximated.

The machine code is kept in a folder for each state of the sources and of the software that compiles them.
Numba's own cache looks at the file of the outermost function only. Here the name of the folder is a hash of all rooms that have
kernels, so an edit in any of them leads to another folder. The folder lies beside the package if that is writable, or below
NUMBA_CACHE_DIR if that is set; otherwise in the user's cache folder.
"""

import contextlib
import fcntl
import functools
import hashlib
import importlib.util
import logging
import os
import platform
import shutil
import signal
import tempfile
import threading
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.kernel import KERNELS, bound

Function = Callable[..., Any]

# Before Numba is imported: where colorama is installed, Numba lets it wrap the standard streams and reset colours at the exit,
# also on terminals without colours.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

DISABLED = "VESSEL_HSMC_INTERPRETED"
"""Environment variable that switches compilation off, as Numba's own does; worker processes inherit it."""


def disable() -> None:
    """Run everything interpreted, in this process and in those that it starts."""
    os.environ[DISABLED] = "1"


def available() -> bool:
    """Whether kernels can be compiled."""
    return all(os.environ.get(name, "0") in ("", "0") for name in (DISABLED, "NUMBA_DISABLE_JIT")) and _installed()


@functools.cache
def _installed() -> bool:
    found = importlib.util.find_spec("numba") is not None
    if not found:
        slow = "simulations run interpreted, some 100 times slower"
        logging.getLogger(__name__).warning("warning: %s; %s", missing_module(ModuleNotFoundError(name="numba")), slow)
    return found


_loading = threading.RLock()  # held while machine code is loaded or compiled, for which Numba's folder is changed


class Compiled:
    """A kernel as machine code, loaded from the cache or compiled at its first call; interpreted where nothing can be compiled.

    `title`: what to call it in the log, if it takes long to compile. `kernels`: kernels that take the place of names of its
    module.
    """

    def __init__(self, function: Function, title: str, kernels: Mapping[str, Function], allocates: bool = True) -> None:
        self._function, self._kernels, self._title, self._allocates = function, kernels, title, allocates
        names = (f"{each.__module__}.{each.__qualname__}" for each in (function, *kernels.values()))
        self._name = "-".join(name.removeprefix("vessel_hsmc_ros.") for name in names)
        self._call: Function | None = None

    @property
    def stored(self) -> bool:
        """Whether a call needs no compilation."""
        return self._call is not None or any(_stored(place / cache_key() / self._name) for place in cache_places())

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code, or the kernel itself; arguments with defaults may be left out."""
        if not available():
            return bound(self._function, **self._kernels)(*arguments)
        if (missing := self._function.__code__.co_argcount - len(arguments)) > 0:
            arguments += (self._function.__defaults__ or ())[-missing:]
        if self._call is None:
            with _loading:
                self._call = self._call or self._loaded(arguments)
        return uninterrupted(self._call, arguments)

    def _loaded(self, arguments: tuple[Any, ...]) -> Any:
        """Load the machine code for the types of some arguments, or compile and store it."""
        import numba  # takes half a second, for which nodes and interpreted runs need not wait

        import vessel_hsmc_ros.simulation.numba_additions  # noqa: F401 - tells Numba of them

        log = logging.getLogger(__name__)
        with cached(self._name) as entry:
            if self._title and not entry.present:
                log.warning("compiling %s: once, some 40 s", self._title)
            signature = tuple(numba.typeof(argument) for argument in arguments)
            call = self._dispatcher(entry)
            try:
                call.compile(signature)
            except Exception as error:
                if not entry.present:
                    raise
                log.warning("compiling %s again, as its stored code cannot be read: %r", self._name, error)
                entry.discard()
                call = self._dispatcher(entry)
                call.compile(signature)
        return call

    def _dispatcher(self, entry: "CacheEntry") -> Any:
        import numba

        with entry.in_use():
            kernel = _rebuilt(self._function, self._kernels, self._allocates)
            return numba.njit(**_options(self._allocates), cache=entry.writable)(kernel)


def uninterrupted(call: Function, arguments: tuple[Any, ...]) -> Any:
    """Call machine code; signals with a handler in Python, which may raise an exception, wait until it has returned.

    Numba makes the NamedTuples of the result by calling their classes, and the process crashes if an exception occurs there.
    """
    if threading.current_thread() is not threading.main_thread():
        return call(*arguments)
    waiting: list[tuple[int, Any]] = []
    handlers: dict[int, Any] = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    handlers = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in handlers:
        signal.signal(number, lambda *given: waiting.append(given))
    try:
        result = call(*arguments)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for number, frame in waiting:
        handlers[number](number, frame)
    return result


_made: dict[Any, Compiled] = {}


def compiled(function: Function, title: str = "", allocates: bool = True, **kernels: Function) -> Compiled:
    """A kernel compiled, with all the kernels that it calls.

    `title`: what to call it in the log, if it takes long to compile. `allocates`: whether it makes arrays. A kernel that does
    not is twice as fast without the counting of references to its arguments' arrays. `kernels`: kernels that take the place of
    names of its module, as in `core.kernel.bound`.
    """
    key = function, allocates, *kernels.items()
    if key not in _made:
        _made[key] = Compiled(function, title, kernels, allocates)
    return _made[key]


@functools.cache
def _inner(function: Function, allocates: bool) -> Function:
    """A kernel that is called by another one; it is compiled together with that one."""
    import numba

    dispatcher: Function = numba.njit(**_options(allocates), forceinline=not allocates)(_rebuilt(function, {}, allocates))
    return dispatcher


def _options(allocates: bool) -> dict[str, bool | str]:
    # error_model: a division by zero gives infinity or NaN, without a test in every division.
    return {"error_model": "numpy", "nogil": True, "_nrt": allocates}


def _rebuilt(function: Any, kernels: Mapping[str, Function], allocates: bool) -> Function:
    """A copy of a kernel that calls compiled kernels."""
    used = {name: function.__globals__.get(name) for name in function.__code__.co_names} | dict(kernels)
    called = {name: each for name, each in used.items() if isinstance(each, types.FunctionType) and each in KERNELS}
    return bound(function, **{name: _inner(each, allocates) for name, each in called.items()})


PACKAGE = Path(__file__).parents[1]

MARK = "\n@kernel\n"  # what a room with kernels has in one of its files
KEPT_VERSIONS = 4  # number of folders that are kept in a place, so that environments that share it do not remove each other's


@dataclass(frozen=True)
class CacheEntry:
    """The stored machine code of one kernel."""

    folder: Path
    present: bool  # whether there is any
    writable: bool  # whether it can be read or written there; if not, the kernel is compiled anew in every process

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
def cached(name: str) -> Iterator[CacheEntry]:
    """A context with the entry of a kernel; it is locked as long as it is empty, so that two processes do not both compile."""
    folders = [place / cache_key() / name for place in cache_places()]
    found = next((folder for folder in folders if _stored(folder)), None)
    folder = found if found and os.access(found, os.W_OK) else next((folder for folder in folders if _folder_made(folder)), None)
    if found and folder:
        if folder != found:  # Numba takes only folders that are writable; that of an installation may not be
            shutil.copytree(found, folder, dirs_exist_ok=True)
        yield CacheEntry(folder, True, True)
        return
    if folder is None:
        logging.getLogger(__name__).warning("warning: compiled kernels cannot be kept: %s is not writable", cache_places()[-1])
        yield CacheEntry(Path(tempfile.gettempdir()), False, False)
        return
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield CacheEntry(folder, _stored(folder), True)
    _remove_stale(folder.parent)


def cache_places() -> list[Path]:
    """The folders that may hold compiled kernels, in order of preference."""
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(given) / "vessel_hsmc_ros"]
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return [Path(__file__).parent / "__pycache__" / "kernels", user / "vessel_hsmc_ros" / "kernels"]


@functools.cache
def cache_key() -> str:
    """A hash of the sources of all kernels and of the software and the processor on which the machine code depends."""
    from llvmlite import binding

    digest = hashlib.sha256()
    versions = (version(name) for name in ("numba", "llvmlite", "numpy"))
    # With the path: Numba finds stored code by that of the source file, and a copied tree must not look as if it had any.
    for text in (str(PACKAGE), platform.python_version(), *versions, binding.get_host_cpu_name()):
        digest.update(f"{text}\n".encode())
    for path in kernel_sources():
        digest.update(str(path.relative_to(PACKAGE.parent)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def kernel_sources() -> list[Path]:
    """All files of the rooms that have kernels.

    Not only those with kernels: the types of their arguments and their constants come from others. Machine code reads the fields
    of a type by their position, so code that is older than the type computes garbage or writes out of bounds.
    """
    rooms = sorted({path.parent for path in PACKAGE.rglob("*.py")})
    files = [sorted(room.glob("*.py")) for room in rooms]
    return [path for room in files if any(MARK in each.read_text(encoding="utf-8") for each in room) for path in room]


def _stored(folder: Path) -> bool:
    return any(folder.glob("*/*.nbi"))


def _folder_made(folder: Path) -> bool:
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
