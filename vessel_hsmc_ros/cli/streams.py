"""Standard streams that can be closed, or whose encoding lacks characters."""

import io
import os
import sys

from vessel_hsmc_ros.core.spelling import HANDLER


def prepare_streams() -> None:
    """Open closed standard streams on /dev/null, and let the output spell out characters that its encoding lacks."""
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def _open_closed_streams() -> None:
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # else the next file that is opened, such as a bag, would become this stream
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
    sys.stdin = sys.stdin or _null("r")
    sys.stdout = sys.stdout or _null("w")
    sys.stderr = sys.stderr or _null("w")


def _null(mode: str) -> io.TextIOWrapper:
    return io.TextIOWrapper(io.FileIO(os.devnull, mode), encoding="utf-8")
