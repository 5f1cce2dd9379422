"""The numbers that are taken from a run; results.json holds them, the claims and the errata look them up."""

from dataclasses import dataclass

NAN = float("nan")


@dataclass(frozen=True)
class Numbers:
    """One run's numbers; m, rad, s, N and N·m, suffixed where a unit is another.

    `late` is the last quarter of the run and stands for a root mean square over it; `step` is the root mean square of the
    change from one control period to the next over that quarter.
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
