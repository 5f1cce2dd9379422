"""Constants, internal state and terms of the paper's law."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.laws.hierarchical_parameters import Gains
from vessel_hsmc_ros.laws.network import Neurons

Array = NDArray[np.float64]


class Rates(NamedTuple):
    """Rates of the weights of the three networks, divided by the activations H that they share."""

    u: float
    v: float
    r: float


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    neurons: Neurons


class Memory(NamedTuple):
    """Internal state of the law.

    Attributes:
        W: Weights of the networks for f_u, f_v, f_r, shape (3, l), written in place.
        H: Activations of the last step, shape (l,), written in place.
        scratch: Working memory, shape (3, l).
        growth: Rates of the weights of the last step, divided by H and times T, shape (3, 1), written in place; the next step
            integrates them.
        side: Sign of b - a·z1 at the last step; 0 before the first.
    """

    W: Array
    H: Array
    scratch: Array
    growth: Array
    side: float


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    surge_error_rate: float
    sway_error_rate: float
    heading_error_rate: float
    sway_surface: float
    heading_surface: float
    yaw_surface: float
    surge_surface: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float


def initial(neurons: int) -> Memory:
    """The internal state before the first step, for a number of neurons."""
    return Memory(np.zeros((3, neurons)), np.zeros(neurons), np.zeros((3, neurons)), np.zeros((3, 1)), 0.0)
