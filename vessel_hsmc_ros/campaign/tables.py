"""Shares and tables in words, for all findings of a campaign."""

from collections.abc import Sequence
from typing import NamedTuple

from vessel_hsmc_ros.campaign.statistics import Interval


class Cell(NamedTuple):
    """A number of a table with its bounds below it."""

    value: str
    bounds: str = ""


class Table(NamedTuple):
    """A table: names of its columns, and lines of as many cells."""

    head: tuple[str, ...]
    lines: Sequence[Sequence[Cell]]


def share_text(share: float) -> str:
    """A share in per cent, of two significant digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.4g} %"


def interval_text(interval: Interval) -> str:
    """A confidence interval of a share, in per cent."""
    return f"{share_text(interval.low)} to {share_text(interval.high)}"
