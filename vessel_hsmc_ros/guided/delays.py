"""Prediction through dead times and over the age of a measurement, by the wrench that is already on its way to the hull."""

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.guided.parameters import Gains
from vessel_hsmc_ros.guided.predictor import predict
from vessel_hsmc_ros.guided.state import Memory
from vessel_hsmc_ros.law.applied_wrench import applied, arriving
from vessel_hsmc_ros.law.network import Estimates

LONGEST_ROLL = 12
"""Number of prediction steps through a delay, however many periods it has."""


@kernel
def delays(age: float, m: Memory, g: Gains) -> tuple[int, int]:
    """The periods from a measurement until the present commands of force and moment arrive at the hull.

    For the law, the age of a measurement is a dead time: it lets the ship act on the command of that long ago.

    Args:
        age: Age of the measurement, s.
        m: Internal state with the queue of commands.
        g: Gains.
    """
    late, most = int(age / g.T + 0.5), m.queue.shape[1] - 1 - max(g.surge.delay, g.yaw.delay)
    late = late if late < most else most
    return g.surge.delay + late, g.yaw.delay + late


@kernel
def ahead(motion: Motion, f: Estimates, n_1: int, n_2: int, x: float, m: Memory, g: Gains) -> tuple[Motion, float, float]:
    """The motion at which the present command arrives at the hull, and the wrench that acts just before.

    All commands that arrive until then are known, and the networks' outputs are held: the motion is predicted through the delay
    of the slower input.

    Args:
        motion: State of the ship at the time of the measurement.
        f: Outputs of the networks.
        n_1, n_2: Delays of force and moment from `delays`.
        x: Distance of the pivot ahead of the controlled point, m.
        m: Internal state with the queue of commands.
        g: Gains.
    """
    tau_1, tau_2, n = m.tau_1, m.tau_2, max(n_1, n_2)
    stride, count, sum_1, sum_2 = 1 + n // LONGEST_ROLL, 0, 0.0, 0.0
    for i in range(n):
        # The faster input's command of periods to come is not known: its last one is held.
        tau_1 = applied(tau_1, arriving(m.queue, 0, m.head, max(n_1 - i, 1)), g.surge)
        tau_2 = applied(tau_2, arriving(m.queue, 1, m.head, max(n_2 - i, 1)), g.yaw)
        count, sum_1, sum_2 = count + 1, sum_1 + tau_1, sum_2 + tau_2
        if count == stride or i == n - 1:
            turning = sum_2 / count / g.m33
            motion = predict(motion, f.fu + sum_1 / count / g.m11, f.fv - x * turning, f.fr + turning, g.T * count)
            count, sum_1, sum_2 = 0, 0.0, 0.0
    return motion, tau_1, tau_2
