"""A law run at its own fixed rate on whatever times come in: shared by the node, the offline loop and replay."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.laws import Law, Terms
from vessel_hsmc_ros.laws.terms import diagnosed

Array = NDArray[np.float64]

NO_WRENCH = (0.0, 0.0)


class ControlLoop:
    """Holds the wrench between the instants of the law's rate and counts the instants that were missed.

    Args:
        law: The law to run.
        grid: The instants at which it is due.
        observer: What stands between the measured state and the law; None where the law takes what is measured.

    Attributes:
        estimate: What the law was last told of the ship, shape (6,); None without an observer.
    """

    def __init__(self, law: Law[Any], grid: RateGrid, observer: Observer | None = None) -> None:
        self.law = law
        self.grid = grid
        self.observer = observer
        self.enabled = True
        self.reset()

    def reset(self) -> None:
        """Forget the weights, the estimate, the held wrench and the count."""
        self.forget()
        self.wrench = NO_WRENCH
        self.missed_periods = 0
        self._last_index: int | None = None
        self._lyapunov: float | None = None

    def forget(self) -> None:
        """Forget what was learnt and what was estimated; time and count go on."""
        self.law.reset()
        self.estimate: Array | None = None
        if self.observer:
            self.observer.reset()

    def due(self, stamp: int) -> bool:
        """Whether a time in nanoseconds belongs to a period that has not been served yet."""
        return self.grid.index(stamp) != self._last_index

    def step(
        self, stamp: int, state: Array, reference: Array, reference_acceleration: Array, measured_at: int | None = None
    ) -> Terms:
        """Serve the period that `stamp` lies in: update the law, keep its wrench in `self.wrench`.

        Args:
            stamp: Time of this update, ns.
            state, reference, reference_acceleration: As `Law.update` takes them; the state as measured.
            measured_at: Time of the measurement, on any clock of its own, ns; `stamp` unless said otherwise.

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
        if self.observer:
            state = self.estimate = self.observer.update(stamp if measured_at is None else measured_at, state, self.wrench)
        wrench, terms = self.law.update(seconds(stamp), state, reference, reference_acceleration)
        self.wrench = float(wrench[0]), float(wrench[1])
        if not self.enabled:
            self.wrench = NO_WRENCH
            self.law.reset()
        terms = diagnosed(terms, self._lyapunov, elapsed * self.grid.period)
        self._lyapunov = terms.lyapunov
        return terms
