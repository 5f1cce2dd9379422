"""Which drawn parameters matter: sensitivity indices and rank correlations of the runs that exist, without further ones."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats  # type: ignore[import-untyped]

from vessel_hsmc_ros.campaign.statistics import CONFIDENCE
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import InstallationError

FEWEST = 100
"""Number of runs below which no index is given: the first ten harmonics of fewer are mostly noise."""

MAX_SAMPLES = 20_000
"""Number of runs that are evaluated; more would make the intervals narrower than anybody reads them."""

HARMONICS = 10
RESAMPLES = 100


class Influence(NamedTuple):
    """The influence of a parameter on a metric.

    Attributes:
        first_order: First-order sensitivity index: the share of the variance of the metric's ranks that this parameter explains
            alone, from 0 to 1; an estimate may be slightly negative.
        uncertainty: Half the width of the confidence interval of the index.
        correlation: Spearman's rank correlation, from -1 to 1; NaN for a parameter that is not a number.
    """

    parameter: str
    first_order: float
    uncertainty: float
    correlation: float

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
    metric, (n,); infinite for a run that ended early.

    Returns:
        One entry for each parameter; none for fewer than 100 runs, or where the metric is the same for all of them.

    Raises:
        InstallationError: SALib is not installed.
    """
    if len(values) < FEWEST or not drawn or np.all(values == values[0]):
        return []
    # Shuffled, because parameters with few different values leave the runs in their order, in which a grid is periodic.
    chosen = np.random.default_rng(0).permutation(len(values))[:MAX_SAMPLES]
    ranks = stats.rankdata(values[chosen])
    columns = {name: _numbers(column[chosen]) for name, column in drawn.items()}
    problem = {"num_vars": len(columns), "names": list(columns)}
    found = _rbd_fast()(
        problem, np.column_stack(list(columns.values())), ranks, HARMONICS, RESAMPLES, conf_level=CONFIDENCE, seed=0
    )
    entries = [
        Influence(name, float(index), float(uncertainty), _correlation(drawn[name][chosen], ranks))
        for name, index, uncertainty in zip(columns, found["S1"], found["S1_conf"], strict=True)
    ]
    return sorted(entries, key=lambda entry: -entry.first_order)


def _rbd_fast() -> Any:
    """The method of SALib, which only this report needs."""
    try:
        from SALib.analyze import rbd_fast  # type: ignore[import-untyped]
    except ModuleNotFoundError:
        raise InstallationError("the report of a campaign needs SALib, which is not installed: pip install SALib") from None
    return rbd_fast.analyze


def _numbers(column: NDArray[np.generic]) -> Array:
    """A column as numbers: the place of each value among the different ones where they are texts."""
    return column.astype(float) if _numeric(column) else np.unique(column, return_inverse=True)[1].astype(float)


def _correlation(column: NDArray[np.generic], ranks: Array) -> float:
    if not _numeric(column) or np.all(column == column[0]):
        return math.nan
    return float(stats.spearmanr(column.astype(float), ranks).statistic)


def _numeric(column: NDArray[np.generic]) -> bool:
    return column.dtype.kind in "bfiu"
