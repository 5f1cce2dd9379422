"""What the nodes promise on each signal: the rows of the table in docs/safety.md.

A name in braces, such as {controller.input_timeout}, stands for the default of that parameter, from its declaration.
"""

from typing import NamedTuple

from vessel_hsmc_ros.safety.reasons import Reason


class Promise(NamedTuple):
    """One row.

    Attributes:
        signal: What happens.
        timeout: After which time or above which bound it counts.
        clock: The clock of that time.
        action: What is commanded.
        recovery: How the law commands again.
        reasons: Codes in `~/state` and in the diagnostics.
        tests: Tests that hold the row, `path::name` below test/.
    """

    signal: str
    timeout: str
    clock: str
    action: str
    recovery: str
    reasons: tuple[Reason, ...]
    tests: tuple[str, ...]


SAFE = "safe action, {controller.safety.action}"
ITSELF = "by itself after {controller.safety.fresh_samples} good control periods, at the bounded rate"
KEPT = "none: the last good sample counts until it is overdue"
NEXT = "with the next good sample"
PERSON = "a person: `~/rearm`, then `~/enable`"

STEADY = "steady clock; the node's with use_sim_time"
ROS_TIME = "ROS time, by the stamp"
PERIODS = "control periods"

FRESH, STATES, OUTPUT, PLAUSIBLE = (
    f"safety/test_{name}.py" for name in ("freshness", "supervision", "output_guard", "plausibility")
)
TAKEN = f"{FRESH}::test_a_sample_is_taken_or_refused_with_its_reason"
FAULT = f"{STATES}::test_a_fault_leads_to_the_safe_action_in_the_same_period"
AGAIN = f"{STATES}::test_the_law_commands_again_after_enough_good_periods_without_a_bump"

PROMISES: tuple[Promise, ...] = (
    Promise(
        "odometry or reference is silent",
        "{controller.input_timeout}",
        STEADY,
        SAFE,
        ITSELF,
        (Reason.OVERDUE, Reason.NOT_RECEIVED),
        (f"{FRESH}::test_an_input_is_overdue_by_its_receipt_and_by_its_stamp", AGAIN),
    ),
    Promise(
        "odometry or reference comes late",
        "{controller.input_timeout}",
        ROS_TIME,
        SAFE,
        ITSELF,
        (Reason.STAMP_OLD,),
        (TAKEN, f"{FRESH}::test_a_refused_sample_does_not_prolong_the_last_one"),
    ),
    Promise(
        "a stamp is ahead of the clock",
        "{controller.safety.freshness.future_tolerance}",
        ROS_TIME,
        KEPT,
        NEXT,
        (Reason.STAMP_FUTURE,),
        (TAKEN,),
    ),
    Promise(
        "a sample comes twice, or after a later one",
        "at once",
        ROS_TIME,
        f"dropped and counted; {KEPT}",
        NEXT,
        (Reason.DUPLICATE, Reason.OUT_OF_ORDER),
        (f"{FRESH}::test_duplicates_and_reorderings_are_dropped_and_counted",),
    ),
    Promise(
        "a sample is in another frame, not finite, or too uncertain",
        "at once; covariance {controller.safety.freshness.covariance_limit}",
        "-",
        KEPT,
        NEXT,
        (Reason.WRONG_FRAME, Reason.NOT_FINITE, Reason.UNCERTAIN),
        (TAKEN,),
    ),
    Promise(
        "the odometry jumps as no ship does",
        "{controller.safety.jump_samples} samples held out",
        ROS_TIME,
        KEPT,
        "samples that agree are a re-localisation; the command then moves at the bounded rate",
        (Reason.JUMP,),
        (
            f"{PLAUSIBLE}::test_a_motion_that_no_ship_makes_is_held_out",
            f"{PLAUSIBLE}::test_samples_that_agree_on_a_new_place_are_taken_as_a_relocalisation",
        ),
    ),
    Promise(
        "the law has no value, or one that is not finite, above its limit, or faster than its rate",
        "at once",
        PERIODS,
        SAFE,
        ITSELF,
        (Reason.LAW_UNDEFINED, Reason.COMMAND_NOT_FINITE, Reason.COMMAND_LIMIT, Reason.COMMAND_RATE),
        (FAULT, f"{STATES}::test_a_change_of_the_law_that_is_faster_than_declared_is_a_violation_and_counted"),
    ),
    Promise(
        "the ship is driven and does not move",
        "warning {controller.safety.monitors.not_moving_warning}; safe {controller.safety.monitors.not_moving_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.NOT_MOVING,),
        (f"{PLAUSIBLE}::test_a_ship_that_is_driven_and_does_not_move_gives_a_warning_and_then_the_safe_action",),
    ),
    Promise(
        "the command stays at one limit",
        "warning {controller.safety.monitors.saturation_warning}; safe {controller.safety.monitors.saturation_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.SATURATED,),
        (f"{PLAUSIBLE}::test_a_command_at_one_limit_gives_a_warning_and_then_the_safe_action",),
    ),
    Promise(
        "measurements contradict the observer",
        "warning {controller.safety.monitors.innovation_warning}; safe {controller.safety.monitors.innovation_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.INNOVATION,),
        (f"{PLAUSIBLE}::test_measurements_that_contradict_the_estimate_give_an_alarm",),
    ),
    Promise(
        "enabling, recovery, change of gains, re-localisation",
        "{controller.safety.ramp_time} from a limit of controller.vessel to zero",
        PERIODS,
        "the command moves to the law's at that rate",
        "ends at the law's command, at the latest after twice this time",
        (Reason.HANDOVER,),
        (
            f"{STATES}::test_activation_leads_from_zero_to_the_law_at_the_bounded_rate",
            f"{STATES}::test_the_command_keeps_the_bounded_rate_after_a_change_of_law_or_gains",
            f"{OUTPUT}::test_a_handover_never_exceeds_its_rate_and_never_overshoots",
        ),
    ),
    Promise(
        "a person stops it: `~/stop`",
        "next control period",
        PERIODS,
        "zero at once, from any state",
        PERSON,
        (Reason.IN_STOP,),
        (
            f"{STATES}::test_stop_is_answered_by_the_next_period_from_any_state",
            f"{STATES}::test_a_stop_holds_until_it_is_rearmed_and_then_waits_in_standby",
        ),
    ),
    Promise(
        "a person puts it in standby, or enables it too early",
        "next control period",
        PERIODS,
        "zero at once; the refusal names its reason",
        "a person: `~/enable`",
        (Reason.IN_STANDBY, Reason.NOT_READY),
        (
            f"{STATES}::test_standby_commands_zero_until_it_is_activated",
            f"{STATES}::test_an_activation_that_is_not_ready_is_refused_with_its_reason",
        ),
    ),
)

REMEDIES: dict[Reason, str] = {
    Reason.NONE: "",
    Reason.NOT_RECEIVED: "Start the publisher; `vessel-hsmc watch` and the diagnostics name the topic.",
    Reason.OVERDUE: "Check the publisher and the network; `input_timeout` must exceed the longest gap of a healthy input.",
    Reason.STAMP_OLD: "Synchronise the clocks of the machines, or find what delays the messages.",
    Reason.STAMP_FUTURE: "Synchronise the clocks of the machines; the publisher must stamp with ROS time.",
    Reason.DUPLICATE: "Look for a second publisher or a repeater of the topic.",
    Reason.OUT_OF_ORDER: "As for a duplicate, or a network that reorders.",
    Reason.WRONG_FRAME: "Set the publisher's frames, or `frame_prefix`; with `safety.freshness.frames_checked: false` any frame is"
    " taken.",
    Reason.NOT_FINITE: "The publisher fails: read its log.",
    Reason.UNCERTAIN: "Wait for a better fix, or raise `safety.freshness.covariance_limit`.",
    Reason.JUMP: "Check the positioning; a new place that persists is accepted by itself.",
    Reason.IN_STANDBY: "Call `~/enable`.",
    Reason.IN_STOP: "Remove the cause, then call `~/rearm` and `~/enable`.",
    Reason.NOT_READY: "Wait: the inputs have to be good for `safety.fresh_samples` control periods.",
    Reason.SHUTTING_DOWN: "",
    Reason.HANDOVER: "",
    Reason.COMMAND_NOT_FINITE: "The law fails: keep the bag, and use another law.",
    Reason.COMMAND_LIMIT: "Give the law the vessel's limits, or raise `safety.surge_force_limit` or `yaw_moment_limit`.",
    Reason.COMMAND_RATE: "Reduce the gains, or raise `safety.surge_force_rate` or `yaw_moment_rate`.",
    Reason.LAW_UNDEFINED: "Bring the ship or the reference where the law is defined, or use another law.",
    Reason.CLOCK_BACKWARD: "None if a simulation was restarted; else find what sets the clock.",
    Reason.CLOCK_AHEAD: "As for a clock that was set back.",
    Reason.NOT_MOVING: "Check propulsion, mooring and depth.",
    Reason.SATURATED: "The loads exceed what the ship can give: choose a slower reference.",
    Reason.INNOVATION: "Check the positioning, and the hull data of the observer.",
    Reason.SECOND_PUBLISHER: "Stop the other publisher of `cmd_wrench`.",
    Reason.NO_CONSUMER: "Start the plant, the thrust allocation or your driver; compare the QoS of both ends.",
}
"""What to do about each reason."""
