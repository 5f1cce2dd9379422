"""The results of an independent prototype of the paper's law, beside ours.

The prototype integrated by RK4 at the control period, held the command and advanced the weights by Euler steps, as this package
does. Its unpublished settings (adaptation gains, PD gains, length of the course) are not known, so numbers that depend on them
may differ.
"""

from dataclasses import dataclass

from vessel_hsmc_ros.studies.paper.checks import Results

TOLERANCE = 0.1  # numbers that differ by less than this fraction agree


@dataclass(frozen=True)
class Finding:
    """One number of the prototype."""

    quantity: str  # what was measured
    prototype: float  # the prototype's value
    unit: str  # its unit, with a leading space where one is written
    # run, number: name of our run and of its number
    run: str
    number: str
    at_most: bool = False  # the prototype's value is an upper bound, given to one digit, instead of a value to agree with
    reason: str = ""  # why ours differs, if it does

    def measured(self, results: Results) -> float:
        """Our value."""
        value: float = abs(getattr(results[self.run], self.number))
        return value

    def agrees(self, results: Results) -> bool:
        """Whether both values agree within TOLERANCE."""
        if self.at_most:
            return self.measured(results) <= self.prototype * (1.0 + TOLERANCE)
        # NaN, a number that our run does not have, does not agree.
        return abs(self.measured(results) / self.prototype - 1.0) <= TOLERANCE


SETTLE, FINAL, EARLY = "heading_settling_time", "position_error_final", "position_error_early"
SECOND_CYCLE = "heading_error_second_half_deg"

FINDINGS = (
    Finding("case 1, sliding mode: settling time to 1°", 11.0, " s", "course", SETTLE),
    Finding("case 1, PD: settling time to 1°", 104.0, " s", "course_pd", SETTLE),
    Finding(
        "case 1 disturbed, sliding mode: rms heading error of the second cycle", 0.004, "°", "course_disturbed", SECOND_CYCLE
    ),
    Finding("case 1 disturbed, PD: rms heading error of the second cycle", 10.0, "°", "course_pd_disturbed", SECOND_CYCLE),
    Finding("case 2, straight: position error after 400 s", 5.1, " m", "straight", FINAL),
    Finding("case 2, straight: heading error after 400 s", 0.0001, "°", "straight", "heading_error_final_deg", at_most=True),
    Finding("case 2, circle: position error after 400 s", 24.0, " m", "circle", FINAL),
    Finding("case 2, circle: heading error after 400 s", 0.01, "°", "circle", "heading_error_final_deg", at_most=True),
    Finding("case 2, circle, ship known exactly: position error after 400 s", 50.0, " m", "circle_exact", FINAL),
    Finding("case 3, calm: position error after 400 s", 0.05, " m", "stabilisation_calm", FINAL),
    Finding("case 3: position error after 50 s", 1.0, " m", "stabilisation", EARLY),
    Finding("case 3: position error after 400 s", 9.9, " m", "stabilisation", FINAL),
    Finding("case 3: heading error after 400 s", 0.006, "°", "stabilisation", "heading_error_final_deg", at_most=True),
    Finding("first second: surge force, peak", 3.1e7, " N", "circle", "surge_force_peak"),
    Finding("first second: surge force, peak, as an acceleration", 26.0, " g", "circle", "surge_peak_in_g"),
    Finding("first second: yaw moment, peak", 1.5e9, " N·m", "circle", "yaw_moment_peak"),
)
