"""The adaptation of the guided law's networks: to the innovation along the activations, and towards zero across them."""

from vessel_hsmc_ros.core.arrays import multiply
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.parameters import Gains
from vessel_hsmc_ros.guided.state import Memory
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
    e_u = 0.0 if m.cut_1 else (1.0 - g.z_u) * (1.0 - g.z_u) * scale * clip(measured.u - predicted.u, g.e_max)
    e_v = (1.0 - g.z_v) * (1.0 - g.z_v) * scale * clip(measured.v - predicted.v, g.e_max)
    e_r = 0.0 if m.cut_2 else (1.0 - g.z_r) * (1.0 - g.z_r) * scale * clip(measured.r - predicted.r, g.e_r_max)
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
    m.slow[0] += 0.0 if m.cut_1 else g.step_fu * beyond_u
    m.slow[1] += 0.0 if m.cut_2 else g.step_f * beyond_r
    return Estimates(f.fu + g.lead_u * beyond_u, f.fv, f.fr + g.lead_r * beyond_r)
