"""Constants, internal state, commands and terms of the guided law."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.guided.actuator_identification import Bank, BankState
from vessel_hsmc_ros.guided.current_estimate import STILL_WATER, Current
from vessel_hsmc_ros.guided.parameters import Gains
from vessel_hsmc_ros.guided.station_keeping import NO_SPIN, Spin
from vessel_hsmc_ros.guided.sway_model import SwayPrior, first_sway
from vessel_hsmc_ros.law.network import Neurons

Array = NDArray[np.float64]


class Filter(NamedTuple):
    """Command filter and guidance: rho_c, zeta, direction s, integral xi, and estimates that last.

    `slow_sway` is the slow part of f_v - dv_d, `slow_epsilon` that of epsilon. `keeping`, whether the ship keeps station, is
    False while it approaches or follows a moving reference. `mean_current` is the mean of the estimated current over the angle
    of turn, `mean_magnitude` that of its magnitude, `spin` the turns at rest without progress.
    """

    rate: float
    integral: float
    s: float
    xi: tuple[float, float]
    slow_sway: float = 0.0
    keeping: bool = False
    current: Current = STILL_WATER
    mean_current: tuple[float, float] = (0.0, 0.0)
    mean_magnitude: float = 0.0
    slow_epsilon: float = 0.0
    spin: Spin = NO_SPIN


class Memory(NamedTuple):
    """Internal state of the law.

    Attributes:
        started: Whether there has been a step; before, the prediction has no meaning.
        predicted: The motion predicted for the next step.
        filter: State of the command filter.
        tau_1, tau_2: The wrench that acts on the hull since the last step, as modelled.
        saturated_1, saturated_2: Whether the force and the moment that the last step demanded were beyond their limits.
        head: Column of the present period in `queue`.
        W: Weights of the networks for f_u, f_v, f_r, shape (3, l), written in place.
        H: Activations, shape (l,), written in place.
        scratch: Working memory, shape (3, l).
        growth: Working memory, shape (3, 1): the change of the weights, divided by H.
        slow: Slow parts of the outputs of the networks for f_u and f_r, shape (2,), written in place.
        queue: The last commands of surge force and yaw moment, (2, n + 1) for delays up to n periods, written in place.
        sway: What is learned of a hull that declares `sway_damping_rate`, shape (6, 5), written in place (`sway_model`).
        bank: What is learned of the actuators.
    """

    started: bool
    predicted: Motion
    filter: Filter
    tau_1: float
    tau_2: float
    saturated_1: bool
    saturated_2: bool
    head: int
    W: Array
    H: Array
    scratch: Array
    growth: Array
    slow: Array
    queue: Array
    sway: Array
    bank: BankState


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    neurons: Neurons
    bank: Bank


def initial(neurons: int, delay: int, prior: SwayPrior, bank: BankState) -> Memory:
    """The internal state before the first step.

    Args:
        neurons: Number of neurons.
        delay: The longest delay in periods.
        prior: What is known of the hull.
        bank: The identification of its actuators.
    """
    nowhere = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    filter_ = Filter(0.0, 0.0, 1.0, (0.0, 0.0), 0.0, False, STILL_WATER, (0.0, 0.0), 0.0, 0.0, NO_SPIN)
    arrays = (
        np.zeros((3, neurons)),
        np.zeros(neurons),
        np.zeros((3, neurons)),
        np.zeros((3, 1)),
        np.zeros(2),
        np.zeros((2, delay + 1)),
        first_sway(prior),
    )
    return Memory(False, nowhere, filter_, 0.0, 0.0, False, False, 0, *arrays, bank)


class Command(NamedTuple):
    """Commands of guidance and command filter."""

    psi_c: float
    sigma2: float
    r_c: float
    dr_c: float
    u_c: float
    du_c: float


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    heading_surface: float
    yaw_surface: float
    surge_surface: float
    commanded_heading: float
    commanded_yaw_rate: float
    commanded_surge_velocity: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float
    surge_saturated: float
    yaw_saturated: float
