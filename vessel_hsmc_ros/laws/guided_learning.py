"""The adaptation of the guided law's networks: to the innovation along the activations, and towards zero across them."""

from vessel_hsmc_ros.core.arrays import multiply
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.laws.guided_parameters import Gains
from vessel_hsmc_ros.laws.guided_state import Memory
from vessel_hsmc_ros.laws.network import Estimates, adapt


@kernel
def learn(measured: Motion, HH: float, m: Memory, g: Gains) -> None:
    """Adapt the weights in place, W += (1 - z)²/T·e·H/(HᵀH), to the innovation e.

    A saturated actuator may not deliver what the prediction assumes, so its network is not adapted.

    Args:
        measured: Measured state of the ship.
        HH: HᵀH.
        m: Internal state with the activations at this step and the prediction for it.
        g: Gains.
    """
    p = m.predicted
    # Normalised least mean squares: HᵀH in the denominator makes the learning rate independent of the number of neurons. The
    # small constant prevents a division by zero far from all centres, where H vanishes.
    scale = 1.0 / (g.T * (HH + 1e-6))
    # Innovations are saturated before the networks adapt to them: an outlier must not dominate.
    m.growth[0, 0] = 0.0 if m.cut_1 else (1.0 - g.z_u) * (1.0 - g.z_u) * scale * clip(measured.u - p.u, g.e_max)
    m.growth[1, 0] = (1.0 - g.z_v) * (1.0 - g.z_v) * scale * clip(measured.v - p.v, g.e_max)
    m.growth[2, 0] = 0.0 if m.cut_2 else (1.0 - g.z_r) * (1.0 - g.z_r) * scale * clip(measured.r - p.r, g.e_r_max)
    adapt(m.W, m.growth, m.H, m.scratch)


@kernel
def forget_across(f: Estimates, HH: float, m: Memory, g: Gains) -> None:
    """Let the weights across H decay in place, W -= leak·T·(W - (WᵀH)·H/(HᵀH)); the outputs WᵀH stay.

    The innovation has no information on the weights across H, but noise drives them: without the decay they would grow for ever.

    Args:
        f: Outputs of the networks.
        HH: HᵀH.
        m: Internal state.
        g: Gains.
    """
    share = g.leak * g.T
    scale = share / (HH + 1e-6)
    for i in range(len(m.W)):
        multiply(m.W[i], 1.0 - share, m.W[i])
    m.growth[0, 0], m.growth[1, 0], m.growth[2, 0] = scale * f.fu, scale * f.fv, scale * f.fr
    adapt(m.W, m.growth, m.H, m.scratch)


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
    m.slow[0] += 0.0 if m.cut_1 else g.step_fu * beyond_u
    m.slow[1] += 0.0 if m.cut_2 else g.step_f * beyond_r
    return Estimates(f.fu + g.lead_u * beyond_u, f.fv, f.fr + g.lead_r * beyond_r)
