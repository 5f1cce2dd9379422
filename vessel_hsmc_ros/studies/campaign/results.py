"""The rows of a campaign as arrays, whole or of one law."""

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.tables import text
from vessel_hsmc_ros.studies.campaign.dataset import read_rows
from vessel_hsmc_ros.studies.campaign.plan import Campaign
from vessel_hsmc_ros.studies.campaign.ship_family import SHIP

Column = NDArray[Any]

ALWAYS = ("position_error_rms_last_quarter", "settling_time", "yaw_moment_rms")
"""Metrics that are drawn in every report, beside those with limits."""

LEGS = "leg_cross_track_rms"  # a path or survey is judged by its legs
LENGTH = f"{SHIP}length"  # the drawn length of the hull
_LIMIT = re.compile(r"(\w+) = \S+ above (\S+)")
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class Results:
    """Runs of a campaign."""

    campaign: Campaign
    rows: Mapping[str, Column]  # the columns of its dataset, (n,) each

    def __len__(self) -> int:
        return len(self.rows["run"])

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each run is a failure, (n,)."""
        return self.rows["failed"].astype(bool)

    @property
    def ended_early(self) -> NDArray[np.bool_]:
        """Whether each run ended before its time, (n,)."""
        return self.rows["ended_early"].astype(bool)

    @property
    def drawn(self) -> dict[str, Column]:
        """The drawn parameters, (n,) each: numbers, flags or texts."""
        return {name: self.rows[name] for name in self.campaign.drawn}

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that any run has, those with limits first."""
        there = [name for name in Metrics._fields if np.isfinite(self.rows[name]).any()]
        return tuple(dict.fromkeys([name for name in self._limited if name in there] + there))

    @property
    def _limited(self) -> tuple[str, ...]:
        """The metrics with limits."""
        return *self.campaign.limits, *self.campaign.limits_in_lengths

    @property
    def main(self) -> str:
        """The metric by which runs are ranked: the first with a limit, else of the legs, else the position error at the end."""
        return next(iter(self._limited), LEGS if LEGS in self.metrics else ALWAYS[0])

    @property
    def shown(self) -> tuple[str, ...]:
        """The metrics that are drawn."""
        return tuple(name for name in dict.fromkeys((*self._limited, self.main, *ALWAYS)) if name in self.metrics)

    @cached_property
    def by_variant(self) -> dict[str, "Results"]:
        """The runs of each variant, in the order of the campaign file."""
        column = self.rows[self.campaign.variant_column]
        found = {variant: self._chosen(column == variant) for variant in self.campaign.variants}
        return {variant: results for variant, results in found.items() if len(results)}

    def cost(self, metric: str) -> Array:
        """Magnitudes of a metric, (n,); infinite for a run that ended early, or whose error has not settled.

        One with a limit in lengths of the hull is in lengths.
        """
        values = np.abs(self.rows[metric].astype(float))
        if metric in self.campaign.limits_in_lengths:
            values = values / self.rows.get(LENGTH, self.campaign.base.vessel_sim.vessel.length)
        without = math.inf if metric == "settling_time" else 0.0  # no time is spent at a limit that there is not
        return np.where(self.ended_early, math.inf, np.where(np.isnan(values), without, values))

    def text(self, metric: str, value: float) -> str:
        """A magnitude of a metric with its unit; a dash where there is none."""
        in_lengths = metric in self.campaign.limits_in_lengths and math.isfinite(value)
        return f"{value:.3g} lengths" if in_lengths else text(metric, value)

    def paired(self, first: str, second: str, metric: str) -> tuple[Array, Array]:
        """A metric of two laws on the draws that both have, (m,) each."""
        one, other = self.by_variant[first], self.by_variant[second]
        _, i, j = np.intersect1d(one.rows["draw"], other.rows["draw"], assume_unique=True, return_indices=True)
        return one.cost(metric)[i], other.cost(metric)[j]

    def reasons(self) -> list[tuple[str, int]]:
        """What made runs failures, in general terms, with the number of runs; the most frequent first."""
        lengths = self.campaign.limits_in_lengths
        return Counter(_general(str(text), lengths) for text in self.rows["failure"][self.failed]).most_common()

    def worst(self, count: int) -> NDArray[np.int64]:
        """Indices of the worst runs, those that ended early before those with the largest main metric."""
        order = np.lexsort((self.rows["run"], -self.cost(self.main)))
        return order[:count].astype(np.int64)

    def _chosen(self, mask: NDArray[np.bool_]) -> "Results":
        return Results(self.campaign, {name: column[mask] for name, column in self.rows.items()})


def read(folder: Path) -> Results:
    """Read the results of a campaign, complete or not.

    Raises ScenarioError, CampaignError if the folder is not that of a campaign, or a file of it is damaged; ReportError if it
    has no rows yet.
    """
    table = read_rows(folder)
    if not table.num_rows:
        raise ReportError(f"campaign {folder} has no results yet: vessel-hsmc campaign computes them")
    rows = {name: _array(table.column(name)) for name in table.column_names}
    return Results(Campaign.load(folder), rows)


def _array(column: Any) -> Column:
    """A column of the dataset; lists as texts."""
    values = column.to_numpy()
    if values.dtype == object and not isinstance(values[0], bool):
        return np.array([text if isinstance(text, str) else str(list(text)) for text in values], dtype=str)
    return np.asarray(values)


def _general(reason: str, lengths: Mapping[str, float]) -> str:
    """A reason without the numbers of its run, so that reasons can be counted; some limits are in lengths of the hull."""
    if _LIMIT.search(reason):
        return _LIMIT.sub(lambda m: f"{m[1]} above {f'{lengths[m[1]]:g} lengths' if m[1] in lengths else m[2]}", reason)
    return _NUMBER.sub("…", reason)
