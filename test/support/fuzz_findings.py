"""What counts as a finding of the fuzzing."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fuzz_seeds import folder

from vessel_hsmc_ros.core.exceptions import VesselHsmcError


class Finding(AssertionError):  # noqa: N818 - a finding of the fuzzing
    """A reader accepted or refused in a way that it must not."""


def decided(read: Callable[[], Any]) -> Any:
    """What a reader returns, or None where it refused the input by an error of one line."""
    try:
        return read()
    except VesselHsmcError as error:
        if not str(error).isprintable() or not str(error):
            raise Finding(f"an error of several lines, or of none: {error!r}") from error
        return None


def file(data: bytes, name: str) -> Path:
    path = folder() / name
    path.write_bytes(data)
    return path
