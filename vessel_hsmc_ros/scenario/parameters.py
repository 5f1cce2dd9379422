"""The parameters of every node, each declared once; ROS, YAML, the command line and the docs all read them from here."""

from dataclasses import dataclass

from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.hull import Hull
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.laws import (
    LAWS,
    CourseLawParameters,
    GuidedParameters,
    HierarchicalParameters,
    KnownVessel,
    LosPidParameters,
    NmpcParameters,
    PdParameters,
)
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, WATCHED_TOPICS
from vessel_hsmc_ros.reference.factory import ReferenceShipParameters
from vessel_sim_node.simulator import PlantParameters


def rate(description: str) -> float:
    """Declare a rate, 100 Hz unless said otherwise."""
    return parameter(100.0, description, unit="Hz", low=1.0, high=1000.0)


@dataclass(frozen=True)
class CommonParameters:
    """What every node of the closed loop takes."""

    lockstep: bool = parameter(
        False,
        "Lockstep: one step at a time with the plant, as fast as the machine allows; false runs in real time on the node's"
        " clock. A scenario that leaves it out runs in lockstep.",
    )
    recorded: bool = parameter(
        False, "A recorder takes part: publish nothing before it and the readers of every topic are connected."
    )
    frame_prefix: str = parameter(
        "", "Prefix of the frames odom and base_link, such as alpha/, so that several vessels have frames of their own."
    )


@dataclass(frozen=True)
class SimParameters(PlantParameters, CommonParameters):
    """Parameters of vessel_sim."""

    rate_hz: float = rate("Odometry messages, and plant steps, per second.")
    duration: float = parameter(
        0.0, "Simulated time after which the plant ends the run; 0 goes on for ever.", unit="s", low=0.0, high=1e6
    )
    command_timeout: float = parameter(
        2.0,
        "In lockstep, the wall time to wait for a command before giving up; in real time, the age of a command after"
        " which the wrench is zero.",
        unit="s",
        low=0.01,
        high=60.0,
    )


@dataclass(frozen=True)
class ReferenceParameters(ReferenceShipParameters, CommonParameters):
    """Parameters of reference_ship."""

    rate_hz: float = rate("Reference messages per second.")


@dataclass(frozen=True)
class ControllerParameters(CommonParameters):
    """Parameters of controller."""

    law: str = parameter("hierarchical", "The control law.", choices=tuple(LAWS))
    rate_hz: float = rate("Updates of the law per second.")
    input_timeout: float = parameter(
        0.5, "In real time, the age of odometry or reference after which the wrench is zero.", unit="s", low=0.01, high=60.0
    )
    vessel: KnownVessel = group(KnownVessel)
    observer: ObserverParameters = group(ObserverParameters)
    hierarchical: HierarchicalParameters = group(HierarchicalParameters)
    guided: GuidedParameters = group(GuidedParameters)
    course: CourseLawParameters = group(CourseLawParameters)
    pd: PdParameters = group(PdParameters)
    los_pid: LosPidParameters = group(LosPidParameters)
    nmpc: NmpcParameters = group(NmpcParameters)


@dataclass(frozen=True)
class RecorderParameters(CommonParameters):
    """Parameters of recorder; in lockstep messages are stamped with simulated time, else with their time of receipt."""

    directory: str = parameter("bag", "The bag's folder, which must not exist yet.")
    topics: tuple[str, ...] = parameter(tuple(RECORDED_TOPICS), "Topics to record, relative to the recorder's namespace.")
    all_topics: bool = parameter(False, "Record every topic.")
    regex: str = parameter("", "Record the topics besides whose full names this regular expression matches.")
    exclude: str = parameter("", "Leave out what this regular expression matches, unless it is among the topics by name.")
    compression: str = parameter("zstd", "Compression of the bag's chunks.", choices=("none", "lz4", "zstd"))
    split_size: int = parameter(0, "Begin another file after so many bytes; 0 does not.", unit="B", low=0, high=2**62)
    split_duration: float = parameter(0.0, "Begin another file after so much time; 0 does not.", unit="s", low=0.0, high=1e9)
    scenario: str = parameter("", "What the recorded scenario is called.")
    scenario_file: str = parameter("", "A ROS parameters file that is to travel in the bag, so that it can be run again.")


@dataclass(frozen=True)
class LiveParameters(CommonParameters):
    """Parameters of live."""

    host: str = parameter("127.0.0.1", "Address the live view listens on; 0.0.0.0 lets other machines in.")
    port: int = parameter(8765, "Its port; 0 takes any that is free.", low=0, high=65535)
    topics: tuple[str, ...] = parameter(tuple(WATCHED_TOPICS), "Topics it offers, relative to its namespace.")


@dataclass(frozen=True)
class MarkerParameters(CommonParameters):
    """Parameters of markers."""

    rate_hz: float = parameter(10.0, "Markers published a second.", unit="Hz", low=0.1, high=100.0)
    path_rate_hz: float = parameter(1.0, "Paths published a second.", unit="Hz", low=0.1, high=100.0)
    path_poses: int = parameter(4000, "Poses of a path; older ones are forgotten.", low=2, high=100_000)
    hull: Hull = group(Hull)


WATCHERS: dict[str, type] = {"live": LiveParameters, "markers": MarkerParameters}
"""Nodes that take no part in the loop, and whose parameters are no part of a scenario."""

NODES: dict[str, type] = {
    "vessel_sim": SimParameters,
    "reference_ship": ReferenceParameters,
    "controller": ControllerParameters,
    "recorder": RecorderParameters,
}
