"""Parameters of the nodes outside the closed loop, and groups of parameters that several nodes have in common."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import FenceParameters
from vessel_hsmc_ros.core.hull import DrawnHull, Hull
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.guidance.waypoints import NONE
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, WATCHED_TOPICS


def rate(description: str) -> float:
    """Declare a rate with a default of 100 Hz."""
    return parameter(100.0, description, unit="Hz", low=1.0, high=1000.0)


@dataclass(frozen=True)
class RealTimeParameters:
    """What a node in real time asks of the operating system at its start; its log says what was granted."""

    thread_priority: int = parameter(
        0, "Priority of the node's threads under SCHED_FIFO; 0 leaves them under the usual scheduling.", low=0, high=99
    )
    lock_memory: bool = parameter(False, "Keep all memory of the process in RAM, by mlockall.")
    # ROS has no empty list of integers.
    cpu_affinity: tuple[int, ...] = parameter((-1,), "Cores that the process may use; -1: any.", low=-1, high=1023)


@dataclass(frozen=True)
class CommonParameters:
    """Parameters of every node of the closed loop."""

    lockstep: bool = parameter(
        False,
        "Lockstep: one step at a time with the plant, as fast as the machine allows; false runs in real time on the node's"
        " clock. A scenario that leaves it out runs in lockstep.",
    )
    recorded: bool = parameter(
        False, "A recorder takes part: wait with publishing until it and the readers of every topic are connected."
    )
    frame_prefix: str = parameter(
        "", "Prefix of the frames odom and base_link, such as alpha/, so that several vessels have frames of their own."
    )
    ride_through: bool = parameter(
        False,
        "In lockstep, bridge refused and missing inputs as in real time, by the age of their stamps, and answer every step; false"
        " ends the run with an error.",
    )
    real_time: RealTimeParameters = group(RealTimeParameters)


@dataclass(frozen=True)
class ClockParameters:
    """Whose /clock the plant keeps to in lockstep; without effect in real time."""

    source: str = parameter("own", "Publish /clock, or follow that of another plant.", choices=("own", "follow"))
    # ROS has no empty list of strings in its parameters files.
    followers: tuple[str, ...] = parameter(
        ("",),
        "Namespaces of the plants that follow this one's /clock; an empty name for none. A step begins when all have finished"
        " the one before.",
    )

    @property
    def others(self) -> tuple[str, ...]:
        """The namespaces of the followers, without slashes at their ends."""
        return tuple(name.strip("/") for name in self.followers if name)


def transform() -> bool:
    """Declare whether a node that makes odometry publishes its transform."""
    return parameter(
        False,
        "Publish the pose of the odometry on /tf as well, from odom to base_link. One node only may publish it: marker_node does"
        " too, unless its publish_tf is false.",
    )


def world_frames(what: str) -> tuple[str, ...]:
    """Declare the frames in which the pose of an input may be, `odom` and `map` by default."""
    return parameter(("odom", "map"), f"Frames in which {what} may be, without frame_prefix.")


@dataclass(frozen=True)
class OdometryParameters:
    """What the odometry of a localisation is like."""

    form: str = parameter(
        "odometry",
        "Form of the measured motion: nav_msgs/Odometry on odom, or in real time PoseStamped or PoseWithCovarianceStamped on pose"
        " and TwistStamped on twist.",
        choices=("odometry", "pose_twist", "pose_covariance_twist"),
    )
    frames: tuple[str, ...] = world_frames("the pose of the odometry")
    body_frames: tuple[str, ...] = parameter(("base_link",), "Child frames that the odometry may have, without frame_prefix.")
    twist_frame: str = parameter(
        "child",
        "Frame of the velocities in the odometry: the child frame, as nav_msgs/Odometry has it, or that of the pose (parent).",
        choices=("child", "parent"),
    )


@dataclass(frozen=True)
class DiagnosticsParameters:
    """Limits above which diagnostics warn; they have no effect on what is commanded."""

    surface_limit: float = parameter(
        math.inf,
        "Magnitude of a sliding surface, in its own unit, above which diagnostics warn; inf: never.",
        low=0.0,
        high=math.inf,
        tunable=True,
    )
    weight_norm_limit: float = parameter(
        math.inf,
        "Norm of a network's weights, in the unit of its output, above which diagnostics warn; inf: never.",
        low=0.0,
        high=math.inf,
        tunable=True,
    )


@dataclass(frozen=True)
class BlackBoxParameters:
    """The last messages of a node, kept in memory and written as a bag when an error occurs."""

    duration: float = parameter(
        30.0,
        "In real time, the time for which messages are kept; 0 turns the black box off. In lockstep it is off: the run's bag has"
        " them all.",
        unit="s",
        low=0.0,
        high=600.0,
    )
    directory: str = parameter(
        "",
        "Folder for the bags of the black box; empty means the folder black_box in the run's folder or, for a node that is"
        " started by hand, in ROS_LOG_DIR, ROS_HOME/log or ~/.ros/log.",
    )

    def within(self, folder: Path) -> "BlackBoxParameters":
        """The same with a directory in a folder, unless it has one."""
        return self if self.directory else replace(self, directory=str(folder / "black_box"))


OWNER = "reference_ship.actions"


@dataclass(frozen=True)
class ActionParameters:
    """When a goal is reached or given up, and what follows."""

    reach: float = parameter(
        0.0,
        "Distance of the vessel from the end of a goal within which it is reached; 0 for two radii of gyration, half a length of"
        " most hulls.",
        unit="m",
        low=0.0,
        high=1e4,
    )
    patience: float = parameter(
        30.0,
        "Time without coming nearer, once the reference has arrived, after which a goal counts as not reached.",
        unit="s",
        low=1.0,
        high=1e5,
    )
    tolerance: float = parameter(
        5.0,
        "Longest safe action of the controller, or time without odometry, that does not end a goal.",
        unit="s",
        low=0.0,
        high=1e4,
    )
    at_end: str = parameter(
        "hold",
        "What the vessel does at the end of a mission, with a low battery and without its operator: hold, keep station; stop, the"
        " controller commands zero until ~/rearm; return, sail to `home`.",
        choices=("hold", "stop", "return"),
    )
    home: tuple[float, ...] = parameter(
        NONE, "x, y to return to; [0.0] for those of `initial_pose`.", unit="m", low=-1e6, high=1e6
    )
    datum: tuple[float, ...] = parameter(
        NONE,
        "Latitude and longitude of the origin of the odometry, degrees, for follow_gps_waypoints; [0.0] for those on odom/datum.",
        low=-180.0,
        high=180.0,
    )
    battery: float = parameter(
        0.0,
        "Share of the charge on battery_state below which every goal ends with the action of `at_end`, and none is taken; 0 for"
        " none.",
        low=0.0,
        high=1.0,
    )
    operator_timeout: float = parameter(
        0.0, "Silence on operator_heartbeat after which the same happens; 0 for never.", unit="s", low=0.0, high=1e5
    )

    def __post_init__(self) -> None:
        for name, what in (("home", "x and y"), ("datum", "a latitude and a longitude")):
            if getattr(self, name) != NONE and len(getattr(self, name)) != 2:
                raise ParameterError(f"{OWNER}.{name} must be {what} (got {list(getattr(self, name))})")
        if not abs(self.datum[0]) < 90.0:
            raise ParameterError(
                f"{OWNER}.datum must be a latitude within -90 and 90 degrees, then a longitude (got {list(self.datum)})"
            )


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
