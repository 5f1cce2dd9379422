"""The gains of line-of-sight guidance with PID control."""

from dataclasses import dataclass, replace

from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.laws.guided_rule import unit_time
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

PAPER = KnownVessel()
"""The ship for which the gains were found."""


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class LosPidParameters:
    """Gains; docs/baselines.md describes how they were tuned."""

    guidance: str = parameter("ilos", "Line-of-sight guidance: with an integral, or adaptive (ALOS).", choices=("ilos", "alos"))
    lookahead_time: float = gain(4.0, "Lookahead distance divided by the reference's speed.", "s", "T_D")
    lookahead_distance: float = gain(9.5, "Smallest lookahead distance.", "m", "D_min", low=1e-3)
    drift_gain: float = gain(1.2, "Integral gain of the line-of-sight guidance, which compensates a drift.", "", "k_s")
    adaptation_gain: float = gain(0.002, "Rate of the drift angle per cross-track error; ALOS only.", "1/(m·s)", "gamma")
    along_gain: float = gain(0.9, "Gain from the along-track error to the commanded speed.", "1/s", "k_x")
    catch_up_speed: float = gain(4.0, "Largest difference between commanded and reference speed.", "m/s", "v_e")
    surge_gain: float = gain(1.75, "Proportional gain of the speed controller.", "1/s", "k_u")
    surge_integral_gain: float = gain(0.9, "Integral gain of the speed controller.", "1/s²", "k_iu")
    yaw_bandwidth: float = gain(0.8, "Bandwidth of the heading autopilot.", "rad/s", "w_psi")
    yaw_damping: float = gain(1.3, "Damping ratio of the heading autopilot.", "", "zeta")
    yaw_integral_gain: float = gain(0.04, "Integral gain of the heading autopilot.", "1/s³", "k_ipsi")
    command_bandwidth: float = gain(2.0, "Bandwidth of the commanded-heading filter.", "rad/s", "w_c", low=1e-3)
    capture_radius: float = gain(
        0.1, "Distance in station keeping within which the ship takes the reference's heading.", "m", "R"
    )
    resting_speed: float = gain(0.05, "Speed of the reference below which the ship keeps station.", "m/s", "U_0")
    stretch: float = parameter(
        0.0,
        "Factor by which the times of all gains are longer, for slow actuators; 1: the gains as they are; 0: the gains are those"
        " of the paper's ship; those of another follow from its length, yaw inertia and moment limit, and from its declared lag,"
        " dead time and rate.",
        low=0.0,
        high=1e3,
        tunable=True,
    )


def adapted(p: LosPidParameters, vessel: KnownVessel) -> LosPidParameters:
    """The gains for a ship: those of the paper's ship in its units of length and time, stretched for its actuators.

    Args:
        p: The gains; with `stretch` above 0 they are meant for this ship, and only their times are longer by it.
        vessel: What is declared of the ship; what is not declared of its actuators does not count.
    """
    if p.stretch > 0.0:
        return stretched(p, p.stretch)
    own = scaled(p, vessel.length / PAPER.length, unit_time(vessel) / unit_time(PAPER))
    return stretched(own, derived_stretch(own, vessel))


def scaled(p: LosPidParameters, length: float, time: float) -> LosPidParameters:
    """The gains of a similar ship, of which lengths L and times T = sqrt(m33/tau_2max) are larger by two factors."""
    return replace(
        p,
        lookahead_time=p.lookahead_time * time,
        lookahead_distance=p.lookahead_distance * length,
        adaptation_gain=p.adaptation_gain / (length * time),
        along_gain=p.along_gain / time,
        catch_up_speed=p.catch_up_speed * length / time,
        surge_gain=p.surge_gain / time,
        surge_integral_gain=p.surge_integral_gain / time**2,
        yaw_bandwidth=p.yaw_bandwidth / time,
        yaw_integral_gain=p.yaw_integral_gain / time**3,
        command_bandwidth=p.command_bandwidth / time,
        capture_radius=p.capture_radius * length,
        resting_speed=p.resting_speed * length / time,
    )


def stretched(p: LosPidParameters, q: float) -> LosPidParameters:
    """The gains of the same law with all times longer by q, for a ship whose actuators cannot follow faster ones."""
    return replace(
        p,
        lookahead_time=q * p.lookahead_time,
        lookahead_distance=q * p.lookahead_distance,
        adaptation_gain=p.adaptation_gain / q**2,
        along_gain=p.along_gain / q,
        surge_gain=p.surge_gain / q,
        surge_integral_gain=p.surge_integral_gain / q**2,
        yaw_bandwidth=p.yaw_bandwidth / q,
        yaw_integral_gain=p.yaw_integral_gain / q**3,
        command_bandwidth=p.command_bandwidth / q,
    )


def derived_stretch(p: LosPidParameters, vessel: KnownVessel) -> float:
    """The factor q of `stretched` for the declared actuators: max(1, 1 + w_c·T_e/3, (4·w_psi·T_f)^(1/3)).

    w_c = 2·zeta·w_psi is the crossover frequency of the autopilot. The largest sum T_e of lag and dead time costs phase at w_c/q.
    An input with the time T_f from zero to its limit follows an amplitude A at the frequency w if A·w·T_f is below its limit;
    with all times stretched A decreases by q² and w by q.

    Args:
        p: The gains before.
        vessel: What is declared of its actuators.
    """
    v = vessel
    late = max(max(lag, 0.0) + max(dead, 0.0) for lag, dead in ((v.surge_lag, v.surge_dead_time), (v.yaw_lag, v.yaw_dead_time)))
    rates = (v.surge_force_limit, v.surge_force_rate), (v.yaw_moment_limit, v.yaw_moment_rate)
    full = max(limit / rate if rate > 0.0 else 0.0 for limit, rate in rates)
    slew: float = (4.0 * p.yaw_bandwidth * full) ** (1.0 / 3.0)
    return max(1.0 + 2.0 * p.yaw_damping * p.yaw_bandwidth * late / 3.0, slew)
