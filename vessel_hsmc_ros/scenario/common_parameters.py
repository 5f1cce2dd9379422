"""Parameters that nodes have in common, and groups of them: real time, clock, odometry, diagnostics, black box."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from vessel_hsmc_ros.core.schema import group, parameter


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


def command_timeout() -> float:
    """Declare the age from which on a node passes a command on no longer."""
    return parameter(0.5, "Age of a command after which the output ramps to zero.", unit="s", low=0.01, high=60.0, tunable=True)


def ramp_time() -> float:
    """Declare the time of the ramp of a node that passes commands on."""
    what = "Time in which the output goes from its limit to zero, and back; 0: at once."
    return parameter(2.0, what, unit="s", low=0.0, high=600.0, tunable=True)
