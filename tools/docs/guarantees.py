"""What the nodes guarantee on each signal: the rows of the table in docs/safety.md.

A name in braces, such as {controller.input_timeout}, stands for the default of that parameter, from its declaration.
"""

from typing import NamedTuple

from vessel_hsmc_ros.control.safety.parameters import Reason


class Guarantee(NamedTuple):
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
KEPT_SAMPLE = "none: the last good sample counts until it is overdue"
NEXT = "with the next good sample"

ROS_TIME = "ROS time, by the stamp"
PERIODS = "control periods"

FRESH, STATES, PLAUSIBLE = (f"control/safety/test_{name}.py" for name in ("freshness", "supervision", "plausibility"))
CLOCK, CONTROLLER, PLANT, THRUSTERS = (
    f"nodes/test_{name}.py"
    for name in ("controller_clock", "controller_safety", "vessel_sim_real_time", "thruster_allocation_node")
)
WATCHDOG = "boats/nodes/test_watchdog_node.py"
STANDBY = "nodes/test_standby.py"
MAVLINK = "boats/nodes/test_mavlink_node.py"
PX4 = "boats/nodes/test_px4_node.py"
FENCED = "control/safety/test_fence_guard.py"
FORMS = "boats/nodes/test_faults_of_forms.py"
TAKEN = f"{FRESH}::test_a_sample_is_taken_or_refused_with_its_reason"


GUARANTEES: tuple[Guarantee, ...] = (
    Guarantee(
        "odometry or reference is silent",
        "{controller.input_timeout}",
        "steady clock; the node's with use_sim_time",
        SAFE,
        ITSELF,
        (Reason.OVERDUE, Reason.NOT_RECEIVED),
        (
            f"{FRESH}::test_an_input_is_overdue_by_its_receipt_and_by_its_stamp",
            f"{STATES}::test_the_law_commands_again_after_enough_good_periods_without_a_bump",
            "nodes/test_controller_real_time.py::test_an_input_that_ends_makes_the_wrench_zero_after_the_timeout",
            f"{FORMS}::test_each_fault_of_a_state_leads_to_the_safe_action_and_back",
        ),
    ),
    Guarantee(
        "odometry or reference comes late",
        "{controller.input_timeout}",
        ROS_TIME,
        SAFE,
        ITSELF,
        (Reason.STAMP_OLD,),
        (
            TAKEN,
            f"{FRESH}::test_a_refused_sample_does_not_prolong_the_last_one",
            f"{CONTROLLER}::test_odometry_of_another_time_or_frame_leads_to_the_safe_action_and_back",
        ),
    ),
    Guarantee(
        "a stamp is ahead of the clock",
        "{controller.safety.freshness.future_tolerance}",
        ROS_TIME,
        KEPT_SAMPLE,
        NEXT,
        (Reason.STAMP_FUTURE,),
        (TAKEN, f"{CONTROLLER}::test_odometry_of_another_time_or_frame_leads_to_the_safe_action_and_back"),
    ),
    Guarantee(
        "a sample comes twice, or after a later one",
        "at once",
        ROS_TIME,
        f"dropped and counted; {KEPT_SAMPLE}",
        NEXT,
        (Reason.DUPLICATE, Reason.OUT_OF_ORDER),
        (f"{FRESH}::test_duplicates_and_reorderings_are_dropped_and_counted",),
    ),
    Guarantee(
        "a sample is in another frame, not finite, above 1e8, or too uncertain",
        "at once; covariance {controller.safety.freshness.covariance_limit}",
        "-",
        KEPT_SAMPLE,
        NEXT,
        (Reason.WRONG_FRAME, Reason.NOT_FINITE, Reason.UNCERTAIN),
        (TAKEN, "nodes/test_controller_real_time.py::test_an_input_that_is_not_finite_is_reported_and_ignored"),
    ),
    Guarantee(
        "the odometry jumps as no ship does",
        "{controller.safety.jump_samples} samples held out",
        ROS_TIME,
        KEPT_SAMPLE,
        "samples that agree are a re-localisation; the command then moves at the bounded rate",
        (Reason.JUMP,),
        (
            f"{PLAUSIBLE}::test_a_motion_that_no_ship_makes_is_held_out",
            f"{PLAUSIBLE}::test_samples_that_agree_on_a_new_place_are_taken_as_a_relocalisation",
            f"{CONTROLLER}::test_a_jump_is_held_out_and_then_taken_without_a_bump",
        ),
    ),
    Guarantee(
        "the law has no value, or one that is not finite, above its limit, or faster than its rate",
        "at once",
        PERIODS,
        SAFE,
        ITSELF,
        (Reason.LAW_UNDEFINED, Reason.COMMAND_NOT_FINITE, Reason.COMMAND_LIMIT, Reason.COMMAND_RATE),
        (
            f"{STATES}::test_a_fault_leads_to_the_safe_action_in_the_same_period",
            f"{STATES}::test_a_change_of_the_law_that_is_faster_than_declared_is_a_violation_and_counted",
            "nodes/test_controller_real_time.py::test_where_the_law_has_no_value_the_safe_action_is_commanded",
        ),
    ),
    Guarantee(
        "the ship is driven and does not move",
        "warning {controller.safety.monitors.not_moving_warning}; safe {controller.safety.monitors.not_moving_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.NOT_MOVING,),
        (f"{PLAUSIBLE}::test_a_ship_that_is_driven_and_does_not_move_gives_a_warning_and_then_the_safe_action",),
    ),
    Guarantee(
        "the command stays at one limit",
        "warning {controller.safety.monitors.saturation_warning}; safe {controller.safety.monitors.saturation_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.SATURATED,),
        (f"{PLAUSIBLE}::test_a_command_at_one_limit_gives_a_warning_and_then_the_safe_action",),
    ),
    Guarantee(
        "the measured velocities do not fit the positions, without an observer",
        "5 s of motion, then warning {controller.safety.monitors.velocity_warning}; safe"
        " {controller.safety.monitors.velocity_safe}",
        "ROS time, by the stamp",
        SAFE,
        "velocities of a moving ship that fit, or `~/reset`: a ship at rest shows nothing",
        (Reason.VELOCITY,),
        (
            "control/safety/test_velocities.py::test_wrong_velocities_are_named_and_demand_the_safe_action_within_ten_seconds",
            "control/safety/test_velocities.py::test_velocities_that_fit_give_no_alarm",
            "control/loop/test_velocity_watch.py::test_velocities_in_the_frame_of_the_pose_lead_to_the_safe_action",
        ),
    ),
    Guarantee(
        "the measured heading does not fit the courses of the ship: turned by more than 20°, or it stands still",
        "20 blocks of 1 s or 2·sqrt(L/g) under way, then warning {controller.safety.monitors.heading_warning}; safe"
        " {controller.safety.monitors.heading_safe}",
        "ROS time, by the stamp",
        SAFE,
        "a heading of a moving ship that fits, or `~/reset`: a ship at rest, or on one straight course, shows nothing",
        (Reason.HEADING,),
        (
            "control/safety/test_heading.py::test_a_bias_is_found_whatever_the_current",
            "control/safety/test_heading.py::test_a_heading_that_stands_still_leads_to_the_safe_action",
            "control/safety/test_heading.py::test_a_heading_that_fits_gives_no_alarm",
        ),
    ),
    Guarantee(
        "the vessel could not stop inside of its fence",
        "as soon as its stopping set touches the fence (`controller.safety.fence`)",
        PERIODS,
        "all of the surge force against the motion, at once; then {controller.safety.fence.action}, by the law",
        "by itself once vessel and reference have been inside for 5 s; never while the vessel is outside",
        (Reason.FENCE,),
        (
            f"{FENCED}::test_it_intervenes_where_the_vessel_could_no_longer_stop_inside",
            f"{FENCED}::test_it_brakes_with_all_of_its_force_until_the_vessel_goes_back",
            f"{FENCED}::test_a_law_that_drives_at_the_fence_never_crosses_it",
            f"{FENCED}::test_it_never_releases_a_vessel_that_is_outside",
            f"{FENCED}::test_it_lets_the_law_command_once_vessel_and_reference_are_inside_for_some_time",
            "control/safety/test_stopping.py::test_no_drawn_stop_through_lag_and_rate_limit_is_longer",
            f"{STANDBY}::test_a_vessel_that_comes_too_near_to_its_fence_is_stopped_with_the_distances",
            "processes/test_run_at_a_fence.py::test_a_run_at_a_fence_is_stopped_and_held_inside_as_offline",
        ),
    ),
    Guarantee(
        "the vessel is outside of its fence when the controller is enabled; a scenario, goal or path leaves it",
        "at the start, or with the message",
        "none",
        "refused with place or leg, and distance",
        "a person steers the vessel inside, then `~/enable`; another goal or path",
        (Reason.IN_STANDBY,),
        (
            f"{STANDBY}::test_a_vessel_outside_of_its_fence_is_not_enabled_until_it_is_inside",
            "guidance/test_fence_check.py::test_a_scenario_whose_reference_leaves_the_fence_is_refused",
            "guidance/test_fence_check.py::test_a_vessel_or_reference_that_begins_outside_is_refused",
            "nodes/test_goals.py::test_a_goal_or_path_outside_of_the_fence_is_refused_with_its_leg",
        ),
    ),
    Guarantee(
        "measurements contradict the observer",
        "warning {controller.safety.monitors.innovation_warning}; safe {controller.safety.monitors.innovation_safe}",
        PERIODS,
        SAFE,
        "once the condition has been absent for the time of the warning",
        (Reason.INNOVATION,),
        (f"{PLAUSIBLE}::test_measurements_that_the_observer_rejects_give_an_alarm",),
    ),
    Guarantee(
        "enabling, recovery, change of gains, re-localisation",
        "{controller.safety.ramp_time} from a limit of controller.vessel to zero",
        PERIODS,
        "the command moves to the law's at that rate",
        "ends at the law's command, at the latest after twice this time",
        (Reason.HANDOVER,),
        (
            f"{STATES}::test_activation_leads_from_zero_to_the_law_at_the_bounded_rate",
            f"{STATES}::test_the_command_keeps_the_bounded_rate_after_a_change_of_law_or_gains",
            "control/safety/test_output_guard.py::test_a_handover_never_exceeds_its_rate_and_never_overshoots",
            f"{CONTROLLER}::test_the_law_begins_to_command_at_a_bounded_rate_after_fresh_samples",
            f"{CONTROLLER}::test_a_changed_gain_and_a_reset_move_the_command_at_a_bounded_rate",
        ),
    ),
    Guarantee(
        "a person stops it: `~/stop`",
        "next control period",
        PERIODS,
        "zero at once, from any state",
        "a person: `~/rearm`, then `~/enable`",
        (Reason.IN_STOP,),
        (
            f"{STATES}::test_stop_is_answered_by_the_next_period_from_any_state",
            f"{STATES}::test_a_stop_holds_until_it_is_rearmed_and_then_waits_in_standby",
            f"{CONTROLLER}::test_a_stop_latches_until_it_is_rearmed_and_enabled",
        ),
    ),
    Guarantee(
        "a person puts it in standby, or enables it too early",
        "next control period",
        PERIODS,
        "zero at once; the refusal names its reason",
        "a person: `~/enable`",
        (Reason.IN_STANDBY, Reason.NOT_READY, Reason.NO_CONSUMER),
        (
            f"{STATES}::test_standby_commands_zero_until_it_is_activated",
            f"{STATES}::test_an_activation_that_is_not_ready_is_refused_with_its_reason",
            f"{CONTROLLER}::test_without_start_enabled_the_node_waits_in_standby_for_enable",
            f"{CONTROLLER}::test_enable_is_refused_with_the_reason_while_an_input_is_missing",
        ),
    ),
    Guarantee(
        "the controller is started by hand in real time",
        "at the start",
        "none",
        "standby, unless `start_enabled: true` is given; the log names the call that enables it",
        "a person: `~/enable`",
        (Reason.IN_STANDBY,),
        (
            f"{STANDBY}::test_by_default_a_controller_waits_for_a_person_and_a_run_with_its_own_plant_does_not",
            f"{STANDBY}::test_in_standby_the_log_has_the_call_that_enables_the_node_once",
        ),
    ),
    Guarantee(
        "the hull is not described, or only a part of it; the files given are for nodes of other names",
        "at the start",
        "none",
        "standby: `~/enable` and `start_enabled` are refused with the data that are missing",
        "by a start with the whole hull",
        (Reason.IN_STANDBY,),
        (
            "control/safety/test_enabling.py::test_a_boat_is_enabled_with_all_of_its_hull_data_only",
            f"{STANDBY}::test_a_controller_with_a_part_of_a_hull_does_not_start_and_is_not_enabled",
            f"{STANDBY}::test_a_controller_without_hull_data_is_not_enabled",
            f"{STANDBY}::test_a_renamed_controller_whose_section_is_not_met_is_not_enabled",
        ),
    ),
    Guarantee(
        "the reference is too far away, as with odometry in UTM",
        "100 lengths of the vessel, or `safety.enable_distance`",
        "control periods",
        f"`~/enable` is refused with both places; under way {SAFE}",
        "once it is near; after a refusal a person: `~/enable`",
        (Reason.IN_STANDBY, Reason.JUMP),
        (
            f"{STANDBY}::test_a_reference_out_of_reach_is_refused_with_both_places_until_it_is_near",
            f"{CONTROLLER}::test_a_reference_that_is_out_of_reach_under_way_leads_to_the_safe_action_until_it_is_near",
        ),
    ),
    Guarantee(
        "the reference was silent and goes on elsewhere, as a node that was started again; or the odometry has another datum",
        "2 lengths of the vessel, beyond what its speed explains",
        ROS_TIME,
        "standby, with both places",
        "a person: `~/enable`",
        (Reason.IN_STANDBY,),
        (
            f"{CONTROLLER}::test_a_reference_that_was_started_again_elsewhere_waits_for_a_person",
            f"{CONTROLLER}::test_odometry_with_another_datum_waits_for_a_person",
        ),
    ),
    Guarantee(
        "two nodes publish `cmd_wrench` or `reference`",
        "0.1 s, by the graph",
        "steady clock",
        f"{SAFE}; plant and thrust allocation accept commands of one publisher only; two of the odometry refuse `~/enable`, and"
        " warn under way",
        "once the other publisher is gone, as after a fault",
        (Reason.SECOND_PUBLISHER,),
        (
            f"{CONTROLLER}::test_a_second_publisher_is_an_error_and_leads_to_the_safe_action",
            f"{CONTROLLER}::test_a_second_reference_is_refused_and_leads_to_the_safe_action",
            f"{CONTROLLER}::test_a_second_publisher_of_odometry_refuses_enabling_and_only_warns_under_way",
            f"{PLANT}::test_in_real_time_commands_of_two_publishers_are_not_mixed",
            f"{THRUSTERS}::test_commands_of_two_publishers_are_not_mixed_and_the_thrust_is_zero",
            f"{WATCHDOG}::test_commands_of_two_publishers_are_not_passed_on",
        ),
    ),
    Guarantee(
        "the clock is set back, or has not begun",
        "at once",
        ROS_TIME,
        f"law and inputs are reset; {SAFE}, until there are new inputs",
        ITSELF,
        (Reason.CLOCK_BACKWARD, Reason.NOT_RECEIVED),
        (
            f"{CONTROLLER}::test_a_clock_that_is_set_back_resets_law_and_inputs",
            f"{CLOCK}::test_a_step_of_the_system_clock_is_the_reason_of_the_safe_action",
            f"{CONTROLLER}::test_a_node_without_its_clock_reports_that_it_waits_for_it",
            f"{PLANT}::test_after_a_step_of_the_clock_the_plant_goes_on_and_takes_new_commands_only",
        ),
    ),
    Guarantee(
        "the clock jumps ahead",
        "next control period; 0.5 s is a jump",
        "ROS time beside the steady clock",
        f"the inputs are reset; {SAFE}, until there are new inputs",
        ITSELF,
        (Reason.CLOCK_AHEAD,),
        (
            f"{CLOCK}::test_a_step_of_the_simulated_clock_is_the_reason_of_the_safe_action",
            f"{CLOCK}::test_a_step_of_the_system_clock_is_the_reason_of_the_safe_action",
        ),
    ),
    Guarantee(
        "the controller is ended by SIGINT or SIGTERM",
        "at once; exit waits at most 0.4 s for acknowledgements",
        "steady clock",
        "zero, three times",
        "a new start",
        (Reason.SHUTTING_DOWN,),
        (f"{CONTROLLER}::test_the_last_command_is_zero",),
    ),
    Guarantee(
        "thrust allocation, watchdog or drive is ended by SIGINT or SIGTERM",
        "at once; exit waits at most 0.4 s for acknowledgements",
        "steady clock",
        "zero, three times",
        "a new start",
        (Reason.SHUTTING_DOWN,),
        (
            "nodes/test_allocation_steps.py::test_at_its_end_it_leaves_no_thrust_and_no_shaft_speed",
            "boats/nodes/test_watchdog_steps.py::test_at_its_end_it_leaves_zero_with_stamps_that_no_consumer_takes_for_repetitions",
            "boats/nodes/test_drive_steps.py::test_at_its_end_it_leaves_zero_whether_it_commands_or_ramps",
        ),
    ),
    Guarantee(
        "the controller is killed or stopped by SIGKILL, SIGSTOP",
        "{vessel_sim.command_timeout}, {thruster_allocation.command_timeout}, {watchdog.command_timeout},"
        " {drive.command_timeout}",
        "ROS time by the stamp, and steady clock",
        "plant and thrust allocation: zero; watchdog and drive: ramp of {watchdog.ramp_time}",
        "with the next fresh command; those that waited are refused",
        (Reason.OVERDUE, Reason.STAMP_OLD),
        (
            f"{PLANT}::test_in_real_time_a_command_holds_for_the_timeout_and_no_longer",
            f"{PLANT}::test_commands_of_a_controller_that_was_stopped_and_continues_are_refused",
            f"{THRUSTERS}::test_without_a_command_for_the_time_out_the_thrust_is_zero",
            f"{WATCHDOG}::test_the_output_ramps_to_zero_when_commands_cease_and_back_when_they_return",
            "boats/nodes/test_drive_node.py::test_without_commands_the_output_ramps_to_zero_and_then_ends",
        ),
    ),
    Guarantee(
        "a command is late, ahead, repeated, in another frame or not finite",
        "{vessel_sim.command_timeout}, {vessel_sim.freshness.future_tolerance}",
        ROS_TIME,
        "refused and counted by its consumer",
        "with the next fresh command",
        (Reason.STAMP_OLD, Reason.STAMP_FUTURE, Reason.WRONG_FRAME, Reason.NOT_FINITE),
        (
            f"{PLANT}::test_in_real_time_a_command_that_is_not_fresh_is_refused_named_and_counted",
            f"{THRUSTERS}::test_a_command_that_is_not_finite_is_ignored_and_counted",
            f"{WATCHDOG}::test_a_command_that_is_not_fresh_is_not_passed_on",
            f"{FORMS}::test_each_fault_of_a_command_ends_the_output_and_a_good_one_goes_on",
        ),
    ),
    Guarantee(
        "a node falls silent",
        "{watchdog.heartbeat_timeout}",
        "steady clock",
        "an error in the diagnostics of the watchdog",
        "with its next diagnostics",
        (Reason.OVERDUE,),
        (f"{WATCHDOG}::test_a_node_that_falls_silent_is_named",),
    ),
    Guarantee(
        "an autopilot leaves its mode, is disarmed, restarts or reports a failsafe, or a pilot moves a stick",
        "at once with its message; a heartbeat after {mavlink.heartbeat_timeout}",
        "steady clock",
        "mavlink: zero, and the channels back to the radio; standby of the controller",
        "by a person",
        (Reason.IN_STANDBY,),
        (
            f"{MAVLINK}::test_a_takeover_ends_the_commands_for_good",
            f"{MAVLINK}::test_after_standby_a_person_enables_it_again",
            f"{MAVLINK}::test_a_stick_takes_over_in_guided",
        ),
    ),
    Guarantee(
        "PX4 leaves Offboard, is disarmed, restarts, reports a failsafe or falls silent",
        "at once with its message; silence after {px4.heartbeat_timeout}",
        "steady clock",
        "px4: zero, for as long as Offboard lasts; standby of the controller",
        "by a person",
        (Reason.IN_STANDBY,),
        (f"{PX4}::test_a_takeover_is_zero_for_good", f"{PX4}::test_a_process_that_dies_ends_offboard"),
    ),
)
