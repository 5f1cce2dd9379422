"""What the two ways to run a closed loop have in common: rows of a run, the terms of the law, and which laws are compiled."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

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

    `stamps`: times of the control periods, (m,) ns. `terms`: terms of the kernel, (m, t). `weights`: weights of its networks,
    (m, k, l).

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


Stamps = NDArray[np.int64]

WIDTHS = {
    **{"time": 1, "state": 6, "measured": 6, "reference": 6, "wrench": 2, "command": 2},
    **{"disturbance": 3, "unforced_acceleration": 3, "headings": 2, "disturbing_wrench": 3, "sway_force": 1},
}
"""Columns of a row, with states as their messages give them; `wrench` is the applied one, without its `sway_force`, `headings`
are those of the state and of the measurement in the messages, not wrapped."""

WIDTH = sum(WIDTHS.values())

BRIEF = 7
"""Numbers of a step that metrics need; see `preparation.Kept`."""


class Evaluated(NamedTuple):
    """What the metrics of a run need.

    Attributes:
        time: Times, (n,) s.
        error: x, y, psi of the ship minus those of the reference, as their messages give them, (n, 3).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        command: The commanded ones, at the steps at which a control period begins, (m, 2).
    """

    time: Array
    error: Array
    wrench: Array
    command: Array


class Control(NamedTuple):
    """What the controller has computed, a row for each control period.

    Attributes:
        stamps: Times of the periods, (m,) ns.
        terms: By the field names of ControlState.msg, m rows each.
        estimate: x, y, psi, u, v, r of the observer, (m, 6); None without one.
        published: The same as its message gives it, (m, 6); None without one.
    """

    stamps: Stamps
    terms: dict[str, Array]
    estimate: Array | None
    published: Array | None


class Loop(ABC):
    """A closed loop on its way.

    Attributes:
        samples: Number of rows of the complete run.
        done: Number of rows so far.
        rows: Its rows, by the columns of WIDTHS; those from `done` on have no meaning.
        block: Number of steps after which progress is reported.
    """

    samples: int
    done: int
    rows: Array
    block: ClassVar[int]

    @abstractmethod
    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done.

        Raises:
            SimulationError: the motion is no longer finite.
            ControlError: the law is not defined at a state of the run.
        """

    @abstractmethod
    def control(self) -> Control:
        """What the controller has computed so far."""

    @abstractmethod
    def evaluated(self) -> Evaluated:
        """What the metrics of the steps so far need."""

    @abstractmethod
    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship: x, y, psi, u, v, r, du, dv, dr, (count, 9)."""

    def columns(self) -> dict[str, Array]:
        """The rows so far by the names of WIDTHS."""
        parts = np.split(self.rows[: self.done], np.cumsum([*WIDTHS.values()])[:-1], axis=1)
        return dict(zip(WIDTHS, parts, strict=True))
