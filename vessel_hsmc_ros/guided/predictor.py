"""Prediction of the ship's motion over one control period and over delays, and what is learned from its innovations.

| symbol | meaning | unit |
|---|---|---|
| T | control period | s |
| z_i = exp(-w_i·T) | discrete pole of channel i with bandwidth w_i | - |
| nu | u, v or r | m/s, rad/s |
| f | its estimated unforced acceleration, the output of a network | m/s², rad/s² |
| b | acceleration by the commanded wrench, zero in sway | m/s², rad/s² |

Between two steps nu- = nu + T·(f + b). At a step the innovation e = nu_measured - nu- gives nu = nu- + (1 - z²)·e and
f += (1 - z)²/T·e: a critically damped observer with both poles at z for every T; in continuous time its gains are 2·w and w².
Position and heading have one pole each.

Dead times, and the age of a measurement, are bridged by the wrench that is already on its way to the hull.
"""

import math

from vessel_hsmc_ros.core.arrays import multiply
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import TURN, Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.parameters import Gains
from vessel_hsmc_ros.guided.state import Memory
from vessel_hsmc_ros.law.applied_wrench import applied, arriving
from vessel_hsmc_ros.law.network import Estimates, adapt, outputs


@kernel
def learn(measured: Motion, predicted: Motion, HH: float, m: Memory, g: Gains) -> Estimates:
    """Adapt the weights in place to the innovation e, W += (1 - z)²/T·e·H/(HᵀH), and let those across H decay.

    The innovation has no information on the weights across H, but noise drives them: without the decay W -= leak·T·(W -
    (WᵀH)·H/(HᵀH)), which leaves the outputs as they are, they would grow for ever. A saturated actuator may not deliver what the
    prediction assumes, so its network is not adapted.

    Args:
        measured: Measured state of the ship.
        predicted: What was predicted for this step.
        HH: HᵀH.
        m: Internal state with the activations at this step.
        g: Gains.

    Returns:
        The outputs WᵀH after the adaptation.
    """
    # Normalised least mean squares: HᵀH in the denominator makes the learning rate independent of the number of neurons. The
    # small constant prevents a division by zero far from all centres, where H vanishes.
    per_square, share = 1.0 / (HH + 1e-6), g.leak * g.T
    scale = per_square / g.T
    # Innovations are saturated before the networks adapt to them: an outlier must not dominate.
    e_u = 0.0 if m.saturated_1 else (1.0 - g.z_u) * (1.0 - g.z_u) * scale * clip(measured.u - predicted.u, g.e_max)
    e_v = (1.0 - g.z_v) * (1.0 - g.z_v) * scale * clip(measured.v - predicted.v, g.e_max)
    e_r = 0.0 if m.saturated_2 else (1.0 - g.z_r) * (1.0 - g.z_r) * scale * clip(measured.r - predicted.r, g.e_r_max)
    fu, fv, fr = outputs(m.W, m.H, m.scratch)
    fu, fv, fr = fu + e_u * HH, fv + e_v * HH, fr + e_r * HH
    # Both changes in one step, of which the second acts on the weights after the first.
    kept, back = 1.0 - share, share * per_square
    multiply(m.W, kept, m.W)
    m.growth[0, 0], m.growth[1, 0], m.growth[2, 0] = kept * e_u + back * fu, kept * e_v + back * fv, kept * e_r + back * fr
    adapt(m.W, m.growth, m.H, m.scratch)
    return Estimates(fu, fv, fr)


@kernel
def forecast(f: Estimates, m: Memory, g: Gains) -> Estimates:
    """The outputs of the networks for surge and yaw as they will be when the wrench of this step acts.

    An output follows a ramp with the lag 2/w, and the wrench acts after dead time and lag: as far as the output changes slowly,
    its rate w_f·(f - f_s) with df_s = w_f·(f - f_s) makes up for both.

    Args:
        f: Outputs of the networks.
        m: Internal state with the slow parts f_s, which move on by a period.
        g: Gains.
    """
    beyond_u, beyond_r = f.fu - float(m.slow[0]), f.fr - float(m.slow[1])
    # Where the adaptation is suspended, so is the rate of its output.
    m.slow[0] += 0.0 if m.saturated_1 else g.step_fu * beyond_u
    m.slow[1] += 0.0 if m.saturated_2 else g.step_f * beyond_r
    return Estimates(f.fu + g.lead_u * beyond_u, f.fv, f.fr + g.lead_r * beyond_r)


@kernel
def correct(predicted: Motion, measured: Motion, z_p: float, z_h: float, z_u: float, z_v: float, z_r: float) -> Motion:
    """Correct the predicted motion by the measured one.

    Pose: first-order filter with poles z_p and z_h, the heading error wrapped. Velocities: nu = nu- + (1 - z²)·e.

    Args:
        predicted, measured: Motion at this step.
        z_p, z_h: Poles of position and heading.
        z_u, z_v, z_r: Poles of surge, sway and yaw velocity.

    Returns:
        The corrected motion, its heading in [-pi, pi].
    """
    p, y = predicted, measured
    return Motion(
        p.x + (1.0 - z_p) * (y.x - p.x),
        p.y + (1.0 - z_p) * (y.y - p.y),
        # The difference is wrapped before it is weighted, so that a correction across 180 degrees takes the short way.
        math.remainder(p.psi + (1.0 - z_h) * math.remainder(y.psi - p.psi, TURN), TURN),
        p.u + (1.0 - z_u * z_u) * (y.u - p.u),
        p.v + (1.0 - z_v * z_v) * (y.v - p.v),
        p.r + (1.0 - z_r * z_r) * (y.r - p.r),
    )


@kernel
def predict(motion: Motion, du: float, dv: float, dr: float, T: float) -> Motion:
    """The motion one period later under constant body accelerations; the pose is integrated by the midpoint rule.

    Args:
        motion: Motion at the start of the period.
        du, dv, dr: Body accelerations, held over the period.
        T: Control period, s.

    Returns:
        The motion at the end of the period, its heading in [-pi, pi].
    """
    x, y, psi, u, v, r = motion
    middle = psi + 0.5 * T * (r + 0.5 * T * dr)
    ahead, aside = T * (u + 0.5 * T * du), T * (v + 0.5 * T * dv)
    c, s = math.cos(middle), math.sin(middle)
    return Motion(
        x + ahead * c - aside * s,
        y + ahead * s + aside * c,
        math.remainder(psi + T * (r + 0.5 * T * dr), TURN),
        u + T * du,
        v + T * dv,
        r + T * dr,
    )


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
def predict_arrival(
    motion: Motion, f: Estimates, n_1: int, n_2: int, x: float, m: Memory, g: Gains
) -> tuple[Motion, float, float]:
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
