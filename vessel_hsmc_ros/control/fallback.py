"""The law of the safe action: it steers while the chosen law has no valid command but its inputs are good."""

from typing import Any

from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.laws import Law
from vessel_hsmc_ros.laws.guard import guarded, guarded_step

Inputs = tuple[Motion, Motion, Acceleration, float]


class Fallback:
    """Steps a second law while its wrench is wanted, each time from its initial state.

    Args:
        law: The law.
    """

    def __init__(self, law: Law[Any]) -> None:
        self._law = law
        self._in_use = False

    def step(self, inputs: Inputs | None, wanted: bool) -> tuple[float, float] | None:
        """The wrench of the fallback law; None where it is not wanted or has none.

        Args:
            inputs: Ship, reference, acceleration of the reference and age, as `guarded_step` takes them; None where they are
                missing.
            wanted: Whether the wrench is used.
        """
        if not wanted or inputs is None:
            self._in_use = False
            return None
        try:
            if not self._in_use:
                with guarded(self._law):
                    self._law.reset()
            self._in_use = True
            return guarded_step(self._law, *inputs)[0]
        except ControlError:  # also an error in its code: the ramp takes its place
            self._in_use = False
            return None
