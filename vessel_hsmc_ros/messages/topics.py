"""The topics of a run and their message types; names without a leading slash are relative to the nodes' namespace."""

EVENTS = "events"
"""Calls of services, changed parameters, accepted goals and paths, of all nodes of a vessel."""

RECORDED_TOPICS = {
    "odom": "nav_msgs/msg/Odometry",
    "odom/truth": "nav_msgs/msg/Odometry",
    "cmd_wrench": "geometry_msgs/msg/WrenchStamped",
    "applied_wrench": "geometry_msgs/msg/WrenchStamped",
    "allocated_wrench": "geometry_msgs/msg/WrenchStamped",
    "disturbance": "geometry_msgs/msg/WrenchStamped",
    "dynamics/truth": "geometry_msgs/msg/AccelStamped",
    "reference": "vessel_hsmc_msgs/msg/ReferenceState",
    "reference/pose": "geometry_msgs/msg/PoseStamped",
    "goal_pose": "geometry_msgs/msg/PoseStamped",
    "path": "nav_msgs/msg/Path",
    "controller/state": "vessel_hsmc_msgs/msg/ControlState",
    "controller/estimate": "nav_msgs/msg/Odometry",
    EVENTS: "vessel_hsmc_msgs/msg/Event",
    "/clock": "rosgraph_msgs/msg/Clock",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}

RELAYED = "relayed/"
"""Prefix of the topics on which the relay of scripted faults passes messages on."""

THRUSTER_DEMAND = "std_msgs/msg/Float64"
"""Type of the demands below `thrusters/`."""

FOREIGN_TOPICS = ("goal_pose", "path")
"""Recorded topics that other programs publish; their stamps need not be in the time of the run."""

OPTIONAL_TOPICS = ("odom/truth", "allocated_wrench", "controller/estimate", *FOREIGN_TOPICS)
"""Recorded topics that are not present in every run."""

TYPES_OF_EVERY_NODE = (
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
    "vessel_hsmc_msgs/msg/Event",
)
"""Message types that several nodes publish on one topic: not numbered in sequence, and not stamped in the order of the run."""

WATCHED_TOPICS = {
    **RECORDED_TOPICS,
    "markers": "visualization_msgs/msg/MarkerArray",
    "ship/path": "nav_msgs/msg/Path",
    "reference/path": "nav_msgs/msg/Path",
    "/tf": "tf2_msgs/msg/TFMessage",
}


def message_type(topic: str) -> str:
    """The type of a topic of a run, without its namespace."""
    return RECORDED_TOPICS.get(topic, THRUSTER_DEMAND)
