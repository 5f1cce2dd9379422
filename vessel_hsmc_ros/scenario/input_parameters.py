"""How the inputs that other programs publish are read."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


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
