"""The numbers measured in a run, to which the claims and the errata refer and which results.json stores."""

from dataclasses import dataclass

NAN = float("nan")


@dataclass(frozen=True)
class Numbers:
    """The numbers of one run; NaN where a number does not exist.

    `late` denotes the root mean square over the last quarter of the run; `step` the root mean square, over that quarter, of the
    change from one control period to the next; `share` a fraction; `needed` a lower bound by (34). Units are SI unless a suffix
    such as `deg` or `in_g` names another.
    """

    duration: float = NAN
    ended_at: float = NAN
    singularity_share: float = NAN
    position_error_start: float = NAN
    position_error_early: float = NAN
    position_error_second_quarter: float = NAN
    position_error_late: float = NAN
    position_error_final: float = NAN
    position_error_smallest: float = NAN
    heading_error_rms_deg: float = NAN
    heading_error_second_half_deg: float = NAN
    heading_error_late_deg: float = NAN
    heading_error_final_deg: float = NAN
    heading_settling_time: float = NAN
    heading_reference_second_half_deg: float = NAN
    surge_force_peak: float = NAN
    yaw_moment_peak: float = NAN
    surge_peak_in_g: float = NAN
    surge_velocity_error_late: float = NAN
    sway_velocity_error_late: float = NAN
    surge_force_step: float = NAN
    yaw_moment_step: float = NAN
    nonlinear_damping_share: float = NAN
    surge_error_late: float = NAN
    sway_error_late: float = NAN
    sway_error_on_surfaces: float = NAN
    sway_error_final: float = NAN
    yaw_surface_start: float = NAN
    yaw_surface_late: float = NAN
    yaw_surface_reaching_time: float = NAN
    surge_surface_start: float = NAN
    surge_surface_late: float = NAN
    surge_surface_reaching_time: float = NAN
    surge_error_settling_time: float = NAN
    weighted_sway_surface_late: float = NAN
    weighted_heading_surface_late: float = NAN
    lyapunov_rising_share: float = NAN
    surge_estimate_error: float = NAN
    sway_estimate_error: float = NAN
    yaw_estimate_error: float = NAN
    weights: float = NAN
    activation_spread: float = NAN
    yaw_switching_gain: float = NAN
    yaw_switching_gain_needed: float = NAN
    surge_switching_gain: float = NAN
    surge_switching_gain_needed: float = NAN
    yaw_rate_d_late: float = NAN
    growth_rate: float = NAN
    reduced_sway_error_final: float = NAN
    reduced_deviation: float = NAN
