"""The gains of the paper's law and the choices between its interpretations."""

from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.law.network import NetworkParameters
from vessel_hsmc_ros.law.switching import SWITCHING


def gain(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a non-negative gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e9, symbol=symbol, tunable=True)


def layer(description: str, unit: str, symbol: str) -> float:
    """Declare the width of a boundary layer, 0.01 by default; the arguments are those of `parameter`."""
    return parameter(0.01, description, unit=unit, low=1e-9, high=1e3, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class HierarchicalParameters:
    """Gains of the paper's section 6.2; it gives no adaptation gains, boundary layers or centres, so those are our choice."""

    sway_surface_slope: float = gain(0.3, "Slope of the sway surface (12).", "1/s", "c1")
    heading_surface_slope: float = gain(0.3, "Slope of the heading surface (17).", "1/s", "c2")
    surge_surface_slope: float = gain(0.3, "Slope of the surge surface (23).", "1/s", "c3")
    sway_weight: float = gain(0.001, "Weight of the sway surface in the yaw surface (20).", "rad/m", "a")
    heading_weight: float = gain(100.0, "Weight of the heading surface in the yaw surface (20).", "", "b")
    yaw_reaching_gain: float = gain(100.0, "Reaching gain of the yaw surface (21).", "1/s", "k1")
    surge_reaching_gain: float = gain(100.0, "Reaching gain of the surge surface (27).", "1/s", "k2")
    yaw_switching_gain: float = gain(0.001, "Switching gain of the yaw law (21).", "rad/s²", "eta1")
    surge_switching_gain: float = gain(0.001, "Switching gain of the surge law (27).", "m/s²", "eta2")
    # The units of the adaptation gains differ with the surfaces in (29); they are left out of the declarations.
    sway_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_v (29).", "", "gamma1")
    yaw_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_r (29).", "", "gamma2")
    surge_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_u (29).", "", "gamma3")
    sway_weight_sign: str = parameter(
        "constant",
        "Sign of the sway weight: constant as printed, or switched so that both terms of the yaw surface agree in sign.",
        choices=("constant", "switched"),
    )
    switching: str = parameter(
        "sgn",
        "Switching function of both laws: sgn as printed, saturation with a boundary layer, or tanh.",
        choices=SWITCHING,
    )
    yaw_boundary_layer: float = layer("Boundary layer of the yaw surface; not used with sgn.", "rad/s", "phi1")
    surge_boundary_layer: float = layer("Boundary layer of the surge surface; not used with sgn.", "m/s", "phi2")
    adaptation: str = parameter(
        "lyapunov",
        "Adaptation law of the weights: derived from the Lyapunov function (32), or (29) as printed.",
        choices=("lyapunov", "as_printed"),
    )
    network: NetworkParameters = group(NetworkParameters)


class Gains(NamedTuple):
    """The constants by the paper's symbols, the period T, and the interpretations; `switching` is an index in SWITCHING."""

    c1: float
    c2: float
    c3: float
    a: float
    b: float
    k1: float
    k2: float
    eta1: float
    eta2: float
    gamma1: float
    gamma2: float
    gamma3: float
    m11: float
    m33: float
    T: float
    phi1: float = 0.01
    phi2: float = 0.01
    switching: int = 0
    sign_switches: bool = False
    adapts_as_printed: bool = False


def gains(parameters: HierarchicalParameters, vessel: KnownVessel, period: float) -> Gains:
    """The constants of the law from its parameters, the known vessel and the control period, s."""
    p = parameters
    return Gains(
        **schema.symbols(p),
        **schema.symbols(vessel),
        T=period,
        switching=SWITCHING.index(p.switching),
        sign_switches=p.sway_weight_sign == "switched",
        adapts_as_printed=p.adaptation == "as_printed",
    )
