"""A law run at its own fixed rate on whatever times come in: shared by the node, the offline loop and replay."""

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.laws import Law, Terms
from vessel_hsmc_ros.laws.terms import diagnosed
from vessel_hsmc_ros.timing import RateGrid, seconds

Array = NDArray[np.float64]

NO_WRENCH = (0.0, 0.0)


class ControlLoop:
    """Holds the wrench between the instants of the law's rate and counts the instants that were missed.

    Args:
        law: The law to run.
        grid: The instants at which it is due.
    """

    def __init__(self, law: Law, grid: RateGrid) -> None:
        self.law = law
        self.grid = grid
        self.enabled = True
        self.reset()

    def reset(self) -> None:
        """Forget the weights, the held wrench and the count."""
        self.law.reset()
        self.wrench = NO_WRENCH
        self.missed_periods = 0
        self._last_index: int | None = None
        self._lyapunov: float | None = None

    def due(self, stamp: int) -> bool:
        """Whether a time in nanoseconds belongs to a period that has not been served yet."""
        return self.grid.index(stamp) != self._last_index

    def step(self, stamp: int, state: Array, reference: Array, reference_acceleration: Array) -> Terms:
        """Serve the period that `stamp` lies in: update the law, keep its wrench in `self.wrench`.

        Args:
            stamp: Time of the state and of the reference, ns.
            state, reference, reference_acceleration: As `Law.update` takes them.

        Returns:
            The terms of the law, with what follows from them for every law. While disabled the law runs for its terms only:
            the wrench is zero, and what was learnt is forgotten.
        """
        index = self.grid.index(stamp)
        elapsed = 1
        if self._last_index is not None and index > self._last_index:
            elapsed = index - self._last_index
            self.missed_periods += elapsed - 1
        self._last_index = index
        wrench, terms = self.law.update(seconds(stamp), state, reference, reference_acceleration)
        self.wrench = float(wrench[0]), float(wrench[1])
        if not self.enabled:
            self.wrench = NO_WRENCH
            self.law.reset()
        terms = diagnosed(terms, self._lyapunov, elapsed * self.grid.period)
        self._lyapunov = terms.lyapunov
        return terms
