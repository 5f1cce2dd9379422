"""Parameters of the nodes outside the closed loop that observe a run, or take part on demand."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.fence import FenceParameters
from vessel_hsmc_ros.core.hull import DrawnHull, Hull
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, WATCHED_TOPICS
from vessel_hsmc_ros.scenario.common_parameters import CommonParameters, rate


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
    publish_tf: bool = parameter(
        True,
        "Publish the pose of the odometry on /tf, from odom to base_link, where tf2_msgs is installed; false where another node"
        " does, such as the localisation.",
    )
    path_poses: int = parameter(4000, "Number of poses of a path; older ones are dropped.", low=2, high=100_000)
    vessel: Hull = group(Hull)
    hull: DrawnHull = group(DrawnHull)
    fence: FenceParameters = group(FenceParameters)


@dataclass(frozen=True)
class FaultRelayParameters(CommonParameters):
    """Parameters of fault_relay."""

    script: str = parameter("", "The fault script; empty for none.")
    topics: tuple[str, ...] = parameter(("odom", "reference", "cmd_wrench"), "Topics to pass on, each below relayed/.")
    rate_hz: float = rate("Rate of the plant, by which the relay counts the steps of a lockstep run.")
