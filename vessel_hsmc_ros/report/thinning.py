"""Fewer points for the same picture: the least and the greatest value of each bucket of samples, so that no peak is lost."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Buckets(NamedTuple):
    """How samples are put together.

    Attributes:
        samples: Their number, n.
        size: Samples in a bucket; 1 keeps every sample.
    """

    samples: int
    size: int

    @property
    def number(self) -> int:
        """Buckets, m; the last may be short."""
        return -(-self.samples // self.size)


def buckets(samples: int, limit: int) -> Buckets:
    """The smallest buckets that leave at most `limit` values of `samples`, two of each bucket.

    Args:
        samples: n, at least 1.
        limit: At least 2.
    """
    return Buckets(samples, 1 if samples <= limit else -(-samples // (limit // 2)))


def thin_time(time: Array, chosen: Buckets) -> Array:
    """The times that belong to `thin`'s values: start and middle of each bucket, (2 m,); all of them for buckets of one."""
    if chosen.size == 1:
        return time
    starts = np.arange(chosen.number) * chosen.size
    middles = np.minimum(starts + chosen.size // 2, chosen.samples - 1)
    picked: Array = time[np.column_stack((starts, middles)).ravel()]
    return picked


def thin(values: Array, chosen: Buckets) -> Array:
    """Least and greatest value of each bucket in the order in which they occur, (2 m,); all values for buckets of one.

    Values that are not a number count only where a bucket has nothing else.

    Args:
        values: (n,).
        chosen: From `buckets`.
    """
    if chosen.size == 1:
        return values
    padded = np.full(chosen.number * chosen.size, np.nan)
    padded[: chosen.samples] = values
    rows = padded.reshape(chosen.number, chosen.size)
    unknown = np.isnan(rows)
    least = np.argmin(np.where(unknown, np.inf, rows), axis=1)
    greatest = np.argmax(np.where(unknown, -np.inf, rows), axis=1)
    picks = np.column_stack((np.minimum(least, greatest), np.maximum(least, greatest)))
    extremes: Array = np.take_along_axis(rows, picks, axis=1).ravel()
    return extremes
