"""The numbers of a report as the page carries them: one block of compressed text, and where each array lies in it."""

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.panels import Line
from vessel_hsmc_ros.report.signals import Signal
from vessel_hsmc_ros.report.thinning import Buckets, buckets, thin, thin_time

Array = NDArray[np.float64]

TRACK_POINTS = 20_000
"""Poses of a track that the page carries at most; between them it interpolates."""


def packed(text: bytes) -> str:
    """Compressed (zlib) and in base64."""
    return base64.b64encode(zlib.compress(text, 6)).decode("ascii")


class Payload:
    """Collects the arrays of a page, thinned; arrays that come again are carried once.

    Args:
        limit: Values of one line that are carried at most.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._parts: list[bytes] = []
        self._length = 0
        self._times: dict[int, tuple[Array, Buckets, dict[str, Any]]] = {}

    def text(self) -> str:
        """Everything that was added."""
        return packed(b"".join(self._parts))

    def add(self, values: Array, kind: str = "f4") -> dict[str, Any]:
        """Add an array and say where it is.

        The bytes are sorted by their place in the number, which halves what smooth series take when compressed.
        """
        with np.errstate(over="ignore"):
            raw = np.ascontiguousarray(values).astype("<" + kind)
        where = {"at": self._length, "count": len(raw), "kind": kind}
        self._parts.append(raw.view(np.uint8).reshape(len(raw), -1).T.tobytes())
        self._length += raw.nbytes
        return where

    def line(self, line: Line) -> dict[str, Any]:
        """One line of a panel."""
        chosen, time = self._time(line.time)
        values = self.add(thin(np.asarray(line.values, dtype=float), chosen))
        return {"role": line.role, "time": time, "values": values, "bucket": chosen.size}

    def poses(self, poses: Signal) -> dict[str, Any]:
        """A track of x, y, psi, (n, 3) or wider: positions about their middle, the heading without jumps."""
        picks = np.unique(np.linspace(0, len(poses.time) - 1, min(len(poses.time), TRACK_POINTS)).astype(int))
        chosen = poses.values[picks, :3]
        x, y, psi = chosen.T
        middle = [float(np.nan_to_num(0.5 * (np.nanmin(axis) + np.nanmax(axis)))) for axis in (x, y)]
        return {
            "time": self.add(poses.time[picks], "f8"),
            "x": self.add(x - middle[0]),
            "y": self.add(y - middle[1]),
            "heading": self.add(np.unwrap(psi)),
            "middle": middle,
        }

    def _time(self, time: Array) -> tuple[Buckets, dict[str, Any]]:
        """The buckets of a time axis and where it is; most lines share a few."""
        if id(time) not in self._times:
            chosen = buckets(len(time), self._limit)
            self._times[id(time)] = time, chosen, self.add(thin_time(time, chosen), "f8")
        _, chosen, where = self._times[id(time)]
        return chosen, where
