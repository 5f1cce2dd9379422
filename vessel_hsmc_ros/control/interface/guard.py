"""Calls of the code of a law, which may be a user's: whatever it does wrong becomes one line with its file and line number."""

import math
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from inspect import getfile
from typing import Any

import numpy as np

from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.interface.terms import Terms
from vessel_hsmc_ros.core.exceptions import ControlError, LawError, VesselHsmcError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

KINDS = tuple(type(value) for value in Terms())  # the types of the terms, as the messages require them


def guarded_step(
    law: Law[Any], motion: Motion, desired: Motion, acceleration: Acceleration, age: float = 0.0, heading: float = math.nan
) -> tuple[tuple[float, float], Terms]:
    """Call `step` of a law and check what it returns.

    `age`: how long ago ship and reference were in these states, s, for a law that takes it. `heading`: measured heading, for a
    law that takes it. Returns the wrench and the terms, in plain floats. Raises ControlError if the law is undefined for this
    input, or its wrench is not finite; LawError if the law raised another exception, or returned something else than a wrench
    and terms.
    """
    try:
        aged = (age, heading) if law.takes_heading else (age,) if law.takes_age else ()
        returned = law.step(motion, desired, acceleration, *aged)
    except VesselHsmcError:
        raise
    except Exception as error:
        raise LawError(described(law, error)) from error
    try:
        (tau_1, tau_2), terms = returned
        wrench = float(tau_1), float(tau_2)
        if not (isinstance(terms, Terms) and all(map(isinstance, terms, KINDS))):
            terms = _plain(terms)
    except (TypeError, ValueError):
        raise LawError(
            f"law {named(law)} returned {returned!r:.100}: step returns (surge force, yaw moment), Terms(...)"
        ) from None
    if not (math.isfinite(wrench[0]) and math.isfinite(wrench[1])):
        raise ControlError(f"command of law {named(law)} must be finite numbers (got {wrench[0]} N and {wrench[1]} N·m)")
    return wrench, terms


@contextmanager
def guarded(law: type[Law[Any]] | Law[Any], kind: type[VesselHsmcError] = LawError) -> Iterator[None]:
    """A context for other calls of a law: an exception of its code becomes an error of the given kind."""
    try:
        yield
    except VesselHsmcError:
        raise
    except Exception as error:
        raise kind(described(law, error)) from error


def named(law: type[Law[Any]] | Law[Any]) -> str:
    """The name of a law, or of its class if it has none."""
    return law.name or getattr(law, "__name__", type(law).__name__)


def described(law: type[Law[Any]] | Law[Any], error: Exception) -> str:
    """An exception in the code of a law in one line, with the last place in the law's own file that led to it."""
    frames = traceback.extract_tb(error.__traceback__)
    cls = law if isinstance(law, type) else type(law)
    try:
        file = getfile(cls)
    except (OSError, TypeError):  # a class defined at a prompt has no file
        file = ""
    place = next((frame for frame in reversed(frames) if frame.filename == file), frames[-1])
    message = " ".join(str(error).split())
    return f"law {named(law)} failed at {place.filename}:{place.lineno}: {type(error).__name__}: {message}"


def _plain(terms: Terms) -> Terms:
    """Terms with NumPy's scalars and lists of weights converted. Raises TypeError, ValueError if these are not terms."""
    if not isinstance(terms, Terms):
        raise TypeError
    converters: dict[Any, Any] = {float: float, bool: bool, np.ndarray: partial(np.asarray, dtype=float)}
    return Terms._make(converters[kind](value) for kind, value in zip(KINDS, terms, strict=True))
