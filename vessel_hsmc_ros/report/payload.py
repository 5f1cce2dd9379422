"""The numbers of a page: all arrays in one compressed block of text, with the location of each."""

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.panels import Buckets, Line, buckets, thin, thin_time

Array = NDArray[np.float64]

TRACK_POINTS = 20_000
"""Largest number of poses of a track; the page interpolates between them."""


def packed(text: bytes) -> str:
    """Compress with zlib and encode in base64."""
    return base64.b64encode(zlib.compress(text, 6)).decode("ascii")


class Payload:
    """Collects the arrays of a page, thinned; a time axis that several lines share is stored once.

    `limit`: largest number of values of one line.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._parts: list[bytes] = []
        self._length = 0
        self._times: dict[int, tuple[Array, Buckets, dict[str, Any]]] = {}

    def text(self) -> str:
        """All arrays that were added, compressed."""
        return packed(b"".join(self._parts))

    def add(self, values: Array, kind: str = "f4") -> dict[str, Any]:
        """Add an array.

        `values`: (n,).

        Returns:
            Offset in bytes, count and type, for the page's `unpack`.
        """
        with np.errstate(over="ignore"):  # a diverged run may exceed the range of 32-bit floats
            raw = np.ascontiguousarray(values).astype("<" + kind)
        where = {"at": self._length, "count": len(raw), "kind": kind}
        # Byte shuffling: with bytes of equal significance next to each other, smooth series compress to half the size.
        self._parts.append(raw.view(np.uint8).reshape(len(raw), -1).T.tobytes())
        self._length += raw.nbytes
        return where

    def line(self, line: Line) -> dict[str, Any]:
        """Add one line of a panel, thinned to extremes."""
        chosen, time = self._time(line.time)
        values = self.add(thin(np.asarray(line.values, dtype=float), chosen))
        return {"role": line.role, "time": time, "values": values, "bucket": chosen.size}

    def poses(self, time: Array, poses: Array) -> dict[str, Any]:
        """Add a track: positions relative to their centre, so that 32 bits are sufficient, and the unwrapped heading.

        `time`: (n,), s. `poses`: x, y, psi and more, (n, 3) or wider.
        """
        picks = np.unique(np.linspace(0, len(time) - 1, min(len(time), TRACK_POINTS)).astype(int))
        x, y, psi = poses[picks, :3].T
        middle = [float(np.nan_to_num(0.5 * (np.nanmin(axis) + np.nanmax(axis)))) for axis in (x, y)]
        return {
            "time": self.add(time[picks], "f8"),
            "x": self.add(x - middle[0]),
            "y": self.add(y - middle[1]),
            "heading": self.add(np.unwrap(psi)),
            "middle": middle,
        }

    def points(self, points: NDArray[np.complex128]) -> dict[str, Any]:
        """Add positions x + i·y, relative to their centre."""
        middle = [float(0.5 * (axis.min() + axis.max())) for axis in (points.real, points.imag)]
        return {"x": self.add(points.real - middle[0]), "y": self.add(points.imag - middle[1]), "middle": middle}

    def _time(self, time: Array) -> tuple[Buckets, dict[str, Any]]:
        """The buckets of a time axis and its place; most lines share a few."""
        # By identity: arrays of a run share one time axis. It is kept alive here, so that its id cannot be reused.
        if id(time) not in self._times:
            chosen = buckets(len(time), self._limit)
            self._times[id(time)] = time, chosen, self.add(thin_time(time, chosen), "f8")
        _, chosen, where = self._times[id(time)]
        return chosen, where
