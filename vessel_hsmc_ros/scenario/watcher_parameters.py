"""Parameters of the nodes that only observe a run, or take part in it on demand."""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.hull import DrawnHull, Hull
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, WATCHED_TOPICS
from vessel_hsmc_ros.safety.parameters import FreshnessParameters
from vessel_hsmc_ros.scenario.common_parameters import CommonParameters, rate
from vessel_hsmc_ros.scenario.stack_parameters import DriveParameters, NavsatOdometryParameters


@dataclass(frozen=True)
class RecorderParameters(CommonParameters):
    """Parameters of recorder; in lockstep messages are stamped with simulated time, else with their time of receipt."""

    directory: str = parameter("bag", "The bag's folder, which must not exist yet.")
    topics: tuple[str, ...] = parameter(tuple(RECORDED_TOPICS), "Topics to record, relative to the recorder's namespace.")
    all_topics: bool = parameter(False, "Record all topics.")
    regex: str = parameter("", "Also record the topics whose full names match this regular expression.")
    exclude: str = parameter("", "Do not record topics that match this regular expression, unless they are listed by name.")
    compression: str = parameter("zstd", "Compression of the bag's chunks.", choices=("none", "lz4", "zstd"))
    split_size: int = parameter(0, "Size at which to start a new file; 0 means a single file.", unit="B", low=0, high=2**62)
    split_duration: float = parameter(
        0.0, "Duration after which to start a new file; 0 means a single file.", unit="s", low=0.0, high=1e9
    )
    scenario: str = parameter("", "Name of the recorded scenario.")
    scenario_file: str = parameter("", "ROS parameters file to store in the bag, so that the run can be repeated.")
    law_source: str = parameter("", "Where the code of the law comes from, for the notes of the bag; it is never imported.")


@dataclass(frozen=True)
class LiveParameters(CommonParameters):
    """Parameters of live."""

    host: str = parameter("127.0.0.1", "Address on which the live view listens; 0.0.0.0 admits other machines.")
    port: int = parameter(8765, "Port of the live view; 0 means any free port.", low=0, high=65535)
    topics: tuple[str, ...] = parameter(tuple(WATCHED_TOPICS), "Topics of the live view, relative to its namespace.")


@dataclass(frozen=True)
class MarkerParameters(CommonParameters):
    """Parameters of markers."""

    rate_hz: float = parameter(10.0, "Rate of the markers.", unit="Hz", low=0.1, high=100.0)
    path_rate_hz: float = parameter(1.0, "Rate of the paths.", unit="Hz", low=0.1, high=100.0)
    path_poses: int = parameter(4000, "Number of poses of a path; older ones are dropped.", low=2, high=100_000)
    vessel: Hull = group(Hull)
    hull: DrawnHull = group(DrawnHull)


def passed_on(what: str, unit: str) -> float:
    """Declare the largest force or moment that the watchdog passes on."""
    return parameter(math.inf, f"Largest {what} that is passed on; inf: no limit.", unit=unit, low=0.0, high=math.inf)


@dataclass(frozen=True)
class WatchdogParameters(CommonParameters):
    """Parameters of watchdog, which passes commands on in real time while they are fresh."""

    command_timeout: float = parameter(
        0.5, "Age of a command after which the wrench ramps to zero.", unit="s", low=0.01, high=60.0, tunable=True
    )
    ramp_time: float = parameter(
        2.0, "Time in which the wrench then goes to zero; 0: at once.", unit="s", low=0.0, high=600.0, tunable=True
    )
    rate_hz: float = parameter(50.0, "Rate of the wrench on its way to zero and at zero.", unit="Hz", low=1.0, high=1000.0)
    surge_force_limit: float = passed_on("surge force", "N")
    yaw_moment_limit: float = passed_on("yaw moment", "N·m")
    watched_nodes: tuple[str, ...] = parameter(
        ("controller",), "Nodes in the namespace of the watchdog whose diagnostics must not cease; [''] for none."
    )
    heartbeat_timeout: float = parameter(
        3.0, "Longest time between two diagnostics of a watched node.", unit="s", low=0.1, high=600.0
    )
    freshness: FreshnessParameters = group(FreshnessParameters)


WATCHERS: dict[str, type] = {
    "live": LiveParameters,
    "markers": MarkerParameters,
    "watchdog": WatchdogParameters,
    "navsat_odom": NavsatOdometryParameters,
    "drive": DriveParameters,
}
"""Nodes outside the closed loop, whose parameters are not part of a scenario."""


@dataclass(frozen=True)
class FaultRelayParameters(CommonParameters):
    """Parameters of fault_relay."""

    script: str = parameter("", "The fault script; empty for none.")
    topics: tuple[str, ...] = parameter(("odom", "reference", "cmd_wrench"), "Topics to pass on, each below relayed/.")
    rate_hz: float = rate("Rate of the plant, by which the relay counts the steps of a lockstep run.")


AUXILIARY: dict[str, type] = {"fault_relay": FaultRelayParameters}
"""Nodes whose parameters are not part of a scenario."""
