"""Compiles kernels with Numba: the same text that the nodes interpret, to machine code that gives the same bits.

float64 without fast-math: no operation is reordered, contracted or approximated.
"""

import functools
import importlib.util
import logging
import types
from collections.abc import Callable
from typing import Any

from vessel_hsmc_ros.core.kernel import KERNELS
from vessel_hsmc_ros.simulation import cache

Function = Callable[..., Any]


@functools.cache
def available() -> bool:
    """Whether kernels can be compiled; without Numba everything runs interpreted, which is logged once."""
    found = importlib.util.find_spec("numba") is not None
    if not found:
        logging.getLogger(__name__).warning("warning: Numba is not installed: simulations run interpreted, some 100 times slower")
    return found


class Compiled:
    """A kernel as machine code, loaded from the cache or compiled at its first call.

    Args:
        function: The kernel.
        law: The kernel that takes the place of the name `law_step`; None for a kernel that calls no law.
        title: What is compiled, for the log.
    """

    def __init__(self, function: Function, law: Function | None = None, title: str = "") -> None:
        self._function, self._law = function, law
        self._title = title or function.__name__
        self._call: Function | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code."""
        if self._call is not None:
            return self._call(*arguments)
        return self._first(arguments)

    def _first(self, arguments: tuple[Any, ...]) -> Any:
        """The first call, which loads the machine code, or compiles and stores it."""
        name = f"{self._function.__module__}.{self._title}".replace(" ", "_")
        with cache.entry(name) as entry:
            if not entry.present:
                logging.getLogger(__name__).warning("compiling %s, once: it takes about 20 s", self._title)
            call = self._dispatcher(entry)
            try:
                result = call(*arguments)
            except Exception as error:  # kernels raise nothing: the stored file is damaged, or of another version
                logging.getLogger(__name__).warning("compiling %s again: %s", self._title, error)
                entry.discard()
                call = self._dispatcher(entry)
                result = call(*arguments)
        self._call = call
        return result

    def _dispatcher(self, entry: cache.Entry) -> Function:
        import numba  # takes half a second, for which interpreted runs and nodes need not wait

        from vessel_hsmc_ros.simulation import numba_overloads  # noqa: F401 - registers math.remainder

        step = {} if self._law is None else {"law_step": _inner(self._law)}
        copy = _rebuilt(self._function, step)
        # error_model: a division by zero gives infinity or NaN, without a test in every division.
        with entry.in_use():
            dispatcher: Function = numba.njit(error_model="numpy", nogil=True, cache=entry.writable)(copy)
        return dispatcher


@functools.cache
def compiled(function: Function, law: Function | None = None, title: str = "") -> Compiled:
    """A kernel compiled, with all the kernels that it calls.

    Args:
        function: The kernel.
        law: The kernel that takes the place of the name `law_step`.
        title: What is compiled, for the log.
    """
    return Compiled(function, law, title)


@functools.cache
def _inner(function: Function) -> Function:
    """A kernel that is called by another one; it is compiled together with that one."""
    import numba

    return numba.njit(error_model="numpy", nogil=True)(_rebuilt(function, {}))  # type: ignore[no-any-return]


def _rebuilt(function: Any, replaced: dict[str, Function]) -> Function:
    """The same function, in whose globals the kernels are compiled ones."""
    used = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    names = {name: _inner(value) for name, value in used if _is_kernel(value) and name not in replaced}
    copy = types.FunctionType(function.__code__, {**function.__globals__, **names, **replaced}, function.__name__)
    copy.__module__ = function.__module__
    copy.__qualname__ = function.__qualname__
    return copy


def _is_kernel(value: object) -> bool:
    return isinstance(value, types.FunctionType) and value in KERNELS
