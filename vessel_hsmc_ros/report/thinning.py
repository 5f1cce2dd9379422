"""Decimation for drawing: the minimum and the maximum of each bucket of samples, so that no peak is lost."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Buckets(NamedTuple):
    """A partition of samples.

    Attributes:
        samples: Number of samples, n.
        size: Samples per bucket; 1 keeps every sample.
    """

    samples: int
    size: int

    @property
    def number(self) -> int:
        """Number of buckets, m; the last one may be shorter."""
        return -(-self.samples // self.size)


def buckets(samples: int, limit: int) -> Buckets:
    """Choose the smallest buckets that reduce samples to at most `limit` values, two for each bucket.

    Args:
        samples: Number of samples, at least 1.
        limit: Largest number of values, at least 2.
    """
    return Buckets(samples, 1 if samples <= limit else -(-samples // (limit // 2)))


def thin_time(time: Array, chosen: Buckets) -> Array:
    """Times of the values of `thin`: start and middle of each bucket, (2 m,); all times for buckets of one sample."""
    if chosen.size == 1:
        return time
    starts = np.arange(chosen.number) * chosen.size
    middles = np.minimum(starts + chosen.size // 2, chosen.samples - 1)
    picked: Array = time[np.column_stack((starts, middles)).ravel()]
    return picked


def thin(values: Array, chosen: Buckets) -> Array:
    """Minimum and maximum of each bucket in the order in which they occur, (2 m,); all values for buckets of one sample.

    NaN is returned only for buckets that contain nothing else.

    Args:
        values: (n,).
        chosen: Buckets of n samples.
    """
    if chosen.size == 1:
        return values
    # The last bucket is filled up with NaN, which the masked argmin and argmax below ignore.
    padded = np.full(chosen.number * chosen.size, np.nan)
    padded[: chosen.samples] = values
    rows = padded.reshape(chosen.number, chosen.size)
    unknown = np.isnan(rows)
    least = np.argmin(np.where(unknown, np.inf, rows), axis=1)
    greatest = np.argmax(np.where(unknown, -np.inf, rows), axis=1)
    # In their order in time, so that a line through them does not reverse a slope.
    picks = np.column_stack((np.minimum(least, greatest), np.maximum(least, greatest)))
    extremes: Array = np.take_along_axis(rows, picks, axis=1).ravel()
    return extremes
