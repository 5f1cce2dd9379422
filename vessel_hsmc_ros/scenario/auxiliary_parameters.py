"""Parameters of the nodes that take part in a run only on demand."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.scenario.common_parameters import CommonParameters, rate


@dataclass(frozen=True)
class FaultRelayParameters(CommonParameters):
    """Parameters of fault_relay."""

    script: str = parameter("", "The fault script; empty for none.")
    topics: tuple[str, ...] = parameter(("odom", "reference", "cmd_wrench"), "Topics to pass on, each below relayed/.")
    rate_hz: float = rate("Rate of the plant, by which the relay counts the steps of a lockstep run.")


AUXILIARY: dict[str, type] = {"fault_relay": FaultRelayParameters}
"""Nodes whose parameters are not part of a scenario."""
