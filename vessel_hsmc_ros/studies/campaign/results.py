"""The rows of a campaign as arrays, and exact statements about them that hold for any distribution.

The first two rest on the binomial distribution alone: the number of failures among n independent runs, and the number of runs
below a quantile, are binomial, whatever the distribution of the metric is.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats  # type: ignore[import-untyped]

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.tables import text
from vessel_hsmc_ros.studies.campaign.dataset import read_rows
from vessel_hsmc_ros.studies.campaign.distributions import SHIP
from vessel_hsmc_ros.studies.campaign.plan import Campaign

CONFIDENCE = 0.95  # confidence of all intervals and bounds of a report


class Interval(NamedTuple):
    """A confidence interval; infinite on a side that the sample does not bound."""

    low: float
    high: float


class Quantile(NamedTuple):
    """A quantile of a sample with its confidence interval; infinite where it falls among runs without a value."""

    value: float
    low: float
    high: float


class Paired(NamedTuple):
    """Two laws on the same draws."""

    # better, worse, equal: numbers of draws in which the first has the smaller value, the larger one, the same
    better: int
    worse: int
    equal: int
    share: Interval  # confidence interval of the probability that the first is better, among draws in which they differ
    ratio: Quantile  # median ratio of the first's value to the second's, over the draws in which both have one


def clopper_pearson(failures: int, runs: int, confidence: float = CONFIDENCE) -> Interval:
    """The exact (Clopper-Pearson) confidence interval of a probability.

    With k failures in n runs its ends are quantiles of beta distributions,

        B(α/2; k, n - k + 1)   and   B(1 - α/2; k + 1, n - k),   α = 1 - confidence

    so that for every true probability the interval misses it in at most α of all campaigns.
    """
    if not runs:
        return Interval(0.0, 1.0)
    found = stats.binomtest(failures, runs).proportion_ci(confidence, method="exact")
    return Interval(float(found.low), float(found.high))


def at_most(failures: int, runs: int, confidence: float = CONFIDENCE) -> float:
    """The largest probability of a failure that the runs admit: the one-sided Clopper-Pearson bound.

    Without a failure it is 1 - (1 - confidence)^(1/n), about 3/n at 95 %. Returns the bound, from 0 to 1; 1 without a run.
    """
    return float(stats.beta.ppf(confidence, failures + 1, runs - failures)) if failures < runs else 1.0


def quantile(values: Array, share: float, confidence: float = CONFIDENCE) -> Quantile:
    """A quantile with bounds that are order statistics of the sample.

    The number N of values below the quantile q is binomial (n, share). The l-th and the u-th smallest value enclose q with at
    least the confidence if P(N < l) and P(N >= u) are at most α/2 each. `values`: the sample, (n,); infinite for a run that has
    no value because it ended early.

    Returns the smallest value that at least this share of the sample does not exceed, and the bounds; a bound for which the
    sample is too small is infinite.
    """
    n = len(values)
    if not n:
        return Quantile(math.nan, -math.inf, math.inf)
    ordered = np.sort(values)
    tail = 0.5 * (1.0 - confidence)
    lower = int(stats.binom.ppf(tail, n, share))
    upper = int(stats.binom.ppf(1.0 - tail, n, share)) + 1
    # Rounded before rounding up: 0.07·100 is above 7 by one bit.
    place = max(1, math.ceil(round(share * n, 9)))
    low = float(ordered[lower - 1]) if lower >= 1 else -math.inf
    high = float(ordered[upper - 1]) if upper <= n else math.inf
    return Quantile(float(ordered[place - 1]), low, high)


def paired(first: Array, second: Array) -> Paired:
    """Compare two laws draw by draw: the sign test with an exact interval, and the median ratio.

    `first`: a metric of the first law, (n,); smaller is better, infinite for a run that ended early. `second`: the metric of
    the second law on the same draws, (n,).
    """
    better, worse = int(np.sum(first < second)), int(np.sum(first > second))
    comparable = np.isfinite(first) & np.isfinite(second) & (second > 0.0)
    ratio = quantile(first[comparable] / second[comparable], 0.5)
    return Paired(better, worse, len(first) - better - worse, clopper_pearson(better, better + worse), ratio)


def exceedance(values: Array, points: int = 400) -> tuple[Array, Array, Array, Array]:
    """The share of runs above each value, with pointwise confidence bounds.

    `values`: the sample, (n,); infinite for a run that ended early, which is above every value. Returns finite values in
    increasing order, the share of the runs above each, and its lower and upper bound, (m,) each.
    """
    ordered = np.sort(values)
    n = len(ordered)
    above = np.arange(n)[::-1]
    if n > points:  # from the largest value down, in equal ratios of the number of runs above
        above = np.unique(np.geomspace(1, n, points).astype(int) - 1)[::-1]
    chosen = ordered[n - 1 - above]
    above, chosen = above[np.isfinite(chosen)], chosen[np.isfinite(chosen)]
    tail = 0.5 * (1.0 - CONFIDENCE)
    with np.errstate(invalid="ignore"):  # the lower bound of no run is 0, not a quantile
        low = np.where(above > 0, stats.beta.ppf(tail, above, n - above + 1), 0.0)
    high = stats.beta.ppf(1.0 - tail, above + 1, n - above)
    return chosen, above / max(n, 1), low, high


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


FEWEST = 100  # number of runs below which no index is given: the first ten harmonics of fewer are mostly noise
MAX_SAMPLES = 20_000  # number of runs that are evaluated; more would make the intervals narrower than anybody reads them
HARMONICS = 10
RESAMPLES = 100


class Influence(NamedTuple):
    """The influence of a parameter on a metric."""

    parameter: str
    # first-order sensitivity index: the share of the variance of the metric's ranks that this parameter explains alone, from 0
    # to 1; an estimate may be slightly negative
    first_order: float
    uncertainty: float  # half the width of the confidence interval of the index
    correlation: float  # spearman's rank correlation, from -1 to 1; NaN for a parameter that is not a number

    @property
    def clear(self) -> bool:
        """Whether the interval of the index lies above zero."""
        return self.first_order > self.uncertainty


def influences(drawn: Mapping[str, NDArray[np.generic]], values: Array) -> list[Influence]:
    """The influence of each drawn parameter on a metric, the strongest first.

    RBD-FAST (Tarantola 2006, with the bias correction of Tissot 2012) takes any sample: it sorts the runs by the parameter and
    takes the share of the first harmonics in the spectrum of the metric. It is applied to the ranks of the metric, because
    metrics span decades and a run that ended early has a rank but no value. The index sees an influence that is not monotonic;
    the rank correlation has a sign. `drawn`: values of each parameter, (n,) each: numbers, flags or texts. `values`: the
    metric, (n,); infinite for a run that ended early. Returns one entry for each parameter; none for fewer than 100 runs, or
    where the metric is the same for all of them. Raises InstallationError if SALib is not installed.
    """
    if len(values) < FEWEST or not drawn or np.all(values == values[0]):
        return []
    # Shuffled, because parameters with few different values leave the runs in their order, in which a grid is periodic.
    chosen = np.random.default_rng(0).permutation(len(values))[:MAX_SAMPLES]
    ranks = stats.rankdata(values[chosen])
    columns = {name: _numbers(column[chosen]) for name, column in drawn.items()}
    problem = {"num_vars": len(columns), "names": list(columns)}
    require("SALib")
    from SALib.analyze import rbd_fast  # type: ignore[import-untyped]

    found = rbd_fast.analyze(
        problem, np.column_stack(list(columns.values())), ranks, HARMONICS, RESAMPLES, conf_level=CONFIDENCE, seed=0
    )
    entries = [
        Influence(name, float(index), float(uncertainty), _correlation(drawn[name][chosen], ranks))
        for name, index, uncertainty in zip(columns, found["S1"], found["S1_conf"], strict=True)
    ]
    return sorted(entries, key=lambda entry: -entry.first_order)


def _numbers(column: NDArray[np.generic]) -> Array:
    """A column as numbers: the place of each value among the different ones where they are texts."""
    return column.astype(float) if _numeric(column) else np.unique(column, return_inverse=True)[1].astype(float)


def _correlation(column: NDArray[np.generic], ranks: Array) -> float:
    if not _numeric(column) or np.all(column == column[0]):
        return math.nan
    return float(stats.spearmanr(column.astype(float), ranks).statistic)


def _numeric(column: NDArray[np.generic]) -> bool:
    return column.dtype.kind in "bfiu"


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
        return tuple(dict.fromkeys([name for name in self.campaign.limits if name in there] + there))

    @property
    def main(self) -> str:
        """The metric by which runs are ranked: the first that the file names, else with a limit, else of the legs or the end."""
        return next(iter((*self.campaign.metrics, *self.campaign.limits)), LEGS if LEGS in self.metrics else ALWAYS[0])

    @property
    def shown(self) -> tuple[str, ...]:
        """The metrics that are drawn."""
        named = self.campaign.metrics or (*self.campaign.limits, self.main, *ALWAYS)
        return tuple(name for name in dict.fromkeys(named) if name in self.metrics)

    @cached_property
    def by_variant(self) -> dict[str, "Results"]:
        """The runs of each variant, in the order of the campaign file."""
        column = self.rows[self.campaign.variant_column]
        masks = {variant: column == variant for variant in self.campaign.variants}
        return {
            variant: Results(self.campaign, {name: values[mask] for name, values in self.rows.items()})
            for variant, mask in masks.items()
            if mask.any()
        }

    def cost(self, metric: str) -> Array:
        """Magnitudes of a metric, (n,); infinite for a run that ended early, or whose error has not settled.

        One with a limit in lengths of the hull is in lengths.
        """
        values = np.abs(self.rows[metric].astype(float))
        if metric in self.campaign.in_lengths:
            values = values / self.rows.get(LENGTH, self.campaign.base.vessel_sim.vessel.length)
        without = math.inf if metric == "settling_time" else 0.0  # no time is spent at a limit that there is not
        return np.where(self.ended_early, math.inf, np.where(np.isnan(values), without, values))

    def text(self, metric: str, value: float) -> str:
        """A magnitude of a metric with its unit; a dash where there is none."""
        in_lengths = metric in self.campaign.in_lengths and math.isfinite(value)
        return f"{value:.3g} lengths" if in_lengths else text(metric, value)

    def paired(self, first: str, second: str, metric: str) -> tuple[Array, Array]:
        """A metric of two laws on the draws that both have, (m,) each."""
        one, other = self.by_variant[first], self.by_variant[second]
        _, i, j = np.intersect1d(one.rows["draw"], other.rows["draw"], assume_unique=True, return_indices=True)
        return one.cost(metric)[i], other.cost(metric)[j]

    def reasons(self) -> list[tuple[str, int]]:
        """What made runs failures, in general terms, with the number of runs; the most frequent first."""
        lengths = {name: self.campaign.limits[name] for name in self.campaign.in_lengths}
        return Counter(_general(str(text), lengths) for text in self.rows["failure"][self.failed]).most_common()

    def worst(self, count: int) -> NDArray[np.int64]:
        """Indices of the worst runs, those that ended early before those with the largest main metric."""
        order = np.lexsort((self.rows["run"], -self.cost(self.main)))
        return order[:count].astype(np.int64)


def read(folder: Path) -> Results:
    """Read the results of a campaign, complete or not."""
    table = read_rows(folder)
    if not table.num_rows:
        raise ReportError(f"campaign {folder} has no results yet: vessel-hsmc campaign computes them")
    rows = {name: _array(table.column(name)) for name in table.column_names}
    return Results(Campaign.load(folder), rows)


def of_rows(campaign: Campaign, rows: Sequence[Mapping[str, Any]]) -> Results:
    """The results of rows that are in no dataset."""
    values = {name: [row[name] for row in rows] for name in rows[0] if name not in Metrics._fields}
    columns = {name: np.array([str(each) if isinstance(each, tuple) else each for each in of]) for name, of in values.items()}
    metrics = {name: np.array([row.get(name) for row in rows], float) for name in Metrics._fields}
    return Results(campaign, columns | metrics)


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
