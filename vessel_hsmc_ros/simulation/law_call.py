"""Which laws are compiled, and the terms of a law over a whole run."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.law.kernel_law import FLAGS, KernelLaw
from vessel_hsmc_ros.law.terms import Terms, lyapunov_function, lyapunov_rates, weight_norms


def is_compilable(law: type[Any]) -> bool:
    """Whether a law is one of the package; the kernels of a user's may not be what they seem."""
    return law.__module__.startswith("vessel_hsmc_ros.")


def all_terms(law: KernelLaw[Any], stamps: NDArray[np.int64], grid: RateGrid, terms: Array, weights: Array) -> dict[str, Array]:
    """The terms of every control period, with what follows from them as in `terms.diagnosed`.

    Args:
        law: The law.
        stamps: Times of the control periods, (m,) ns.
        grid: Instants of the control periods.
        terms: Terms of the kernel, (m, t).
        weights: Weights of its networks, (m, k, l).

    Returns:
        All fields of `Terms`, m rows each.
    """
    m = len(stamps)
    given = dict(zip(law.terms._fields, terms.T, strict=True))
    given |= {f"{name}_weights": weights[:, i] for i, name in enumerate(law.networks)}
    found: dict[str, Any] = {}
    for name, default in Terms._field_defaults.items():
        values = given.get(name, np.empty((m, 0)) if name.endswith("_weights") else np.full(m, default))
        found[name] = values != 0.0 if name in FLAGS else np.ascontiguousarray(values)
    for i, norm in enumerate(weight_norms(weights).T):
        found[f"{law.networks[i]}_weight_norm"] = norm
    found["lyapunov"] = lyapunov_function(found["yaw_surface"], found["surge_surface"])
    intervals = np.diff(grid.indices(stamps), prepend=0) * grid.period
    found["lyapunov_rate"] = lyapunov_rates(found["lyapunov"], intervals)
    return found
