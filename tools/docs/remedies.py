"""What to do about each reason of a safe action: a column of the table of reasons in docs/safety.md."""

from vessel_hsmc_ros.control.safety.parameters import Reason

REMEDIES: dict[Reason, str] = {
    Reason.NONE: "",
    Reason.NOT_RECEIVED: "Start the publisher; `vessel-hsmc watch` and the diagnostics name the topic.",
    Reason.OVERDUE: "Check the publisher and the network; `input_timeout` must exceed the longest gap of a healthy input.",
    Reason.STAMP_OLD: "Synchronise the clocks of the machines, or find what delays the messages.",
    Reason.STAMP_FUTURE: "Synchronise the clocks of the machines; the publisher must stamp with ROS time.",
    Reason.DUPLICATE: "Look for a second publisher or a repeater of the topic.",
    Reason.OUT_OF_ORDER: "Look for a second publisher or a repeater of the topic, or a network that reorders messages.",
    Reason.WRONG_FRAME: (
        "Set the publisher's frames, or `odometry.frames`, `odometry.body_frames` and `frame_prefix`; a message that names no"
        " frame is taken, with a warning; `safety.freshness.frames_checked: false` accepts any."
    ),
    Reason.NOT_FINITE: "Read the log of the publisher: it sends values that are not finite.",
    Reason.UNCERTAIN: "Wait for a better fix, or raise `safety.freshness.covariance_limit`.",
    Reason.JUMP: (
        "Check the positioning; a new place that persists is accepted by itself. Compare the reference with"
        " the frame of the odometry."
    ),
    Reason.IN_STANDBY: "Call `~/enable`.",
    Reason.IN_STOP: "Remove the cause, then call `~/rearm` and `~/enable`.",
    Reason.NOT_READY: "Wait until the inputs have been good for `safety.fresh_samples` control periods.",
    Reason.SHUTTING_DOWN: "",
    Reason.HANDOVER: "",
    Reason.COMMAND_NOT_FINITE: "The law has failed: keep the bag for an analysis, and use another law.",
    Reason.COMMAND_LIMIT: "Give the law the vessel's limits, or raise `safety.surge_force_limit` or `yaw_moment_limit`.",
    Reason.COMMAND_RATE: "Reduce the gains, or raise `safety.surge_force_rate` or `yaw_moment_rate`.",
    Reason.LAW_UNDEFINED: "Bring the ship or the reference where the law is defined, or use another law.",
    Reason.CLOCK_BACKWARD: "Nothing, if a simulation was restarted. Otherwise find what sets the clock.",
    Reason.CLOCK_AHEAD: "Find what sets the clock, unless a simulation was restarted.",
    Reason.NOT_MOVING: "Check propulsion, mooring and depth.",
    Reason.SATURATED: "The loads exceed what the ship can give: choose a slower reference.",
    Reason.INNOVATION: "Check the positioning, and the hull data of the observer.",
    Reason.VELOCITY: (
        "Set `odometry.twist_frame`, or the units and signs of the velocities; without velocities set `observer.enabled`. Then"
        " call `~/reset`."
    ),
    Reason.HEADING: (
        "Compare the compass with the course on a straight way without current, correct it (`navsat_odom.heading_offset`), then"
        " call `~/reset`."
    ),
    Reason.FENCE: (
        "The log says how far it goes and how far the fence is. Give a goal or path inside, or call `~/stop` and steer it back by"
        " hand."
    ),
    Reason.SECOND_PUBLISHER: "Stop the other publisher of the topic that the log names.",
    Reason.NO_CONSUMER: "Start the plant, the thrust allocation or your driver; compare the QoS of both ends.",
}
"""What to do about each reason."""
