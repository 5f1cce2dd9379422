"""The figures of an independent prototype of the paper's law, beside ours.

The prototype integrated by RK4 at the control period, held the command and advanced the weights by Euler steps, as this package
does. What it left open (adaptation gains, PD gains, lengths) is not known, so figures that depend on those may differ.
"""

from dataclasses import dataclass

from vessel_hsmc_ros.paper.checks import Results

ALIKE = 0.1
"""Figures that differ by less than this part are the same."""


@dataclass(frozen=True)
class Finding:
    """One figure of the prototype.

    Attributes:
        words: What was measured.
        theirs: By the prototype.
        unit: With the space before it.
        run, number: Ours.
        at_most: The prototype's figure is given to one digit as next to nothing: ours must not be above it.
        why: Where ours differs, the reason.
    """

    words: str
    theirs: float
    unit: str
    run: str
    number: str
    at_most: bool = False
    why: str = ""

    def ours(self, results: Results) -> float:
        """The same, measured here."""
        value: float = abs(getattr(results[self.run], self.number))
        return value

    def alike(self, results: Results) -> bool:
        """Whether the two agree to ALIKE."""
        if self.at_most:
            return self.ours(results) <= self.theirs * (1.0 + ALIKE)
        return abs(self.ours(results) / self.theirs - 1.0) <= ALIKE


SETTLE, FINAL, EARLY = "heading_settling_time", "position_error_final", "position_error_early"
SECOND_CYCLE = "heading_error_second_half_deg"

FINDINGS = (
    Finding("case 1, sliding mode: time to stay below 1°", 11.0, " s", "course", SETTLE),
    Finding("case 1, PD: time to stay below 1°", 104.0, " s", "course_pd", SETTLE),
    Finding("case 1 disturbed, sliding mode: heading error, rms of the second cycle", 0.004, "°", "course_pushed", SECOND_CYCLE),
    Finding("case 1 disturbed, PD: heading error, rms of the second cycle", 10.0, "°", "course_pd_pushed", SECOND_CYCLE),
    Finding("case 2, straight: position error after 400 s", 5.1, " m", "straight", FINAL),
    Finding("case 2, straight: heading error after 400 s", 0.0001, "°", "straight", "heading_error_final_deg", at_most=True),
    Finding("case 2, circle: position error after 400 s", 24.0, " m", "circle", FINAL),
    Finding("case 2, circle: heading error after 400 s", 0.01, "°", "circle", "heading_error_final_deg", at_most=True),
    Finding("case 2, circle, ship known exactly: position error after 400 s", 50.0, " m", "circle_exact", FINAL),
    Finding("case 3, calm: position error after 400 s", 0.05, " m", "hold_calm", FINAL),
    Finding("case 3: position error after 50 s", 1.0, " m", "hold", EARLY),
    Finding("case 3: position error after 400 s", 9.9, " m", "hold", FINAL),
    Finding("case 3: heading error after 400 s", 0.006, "°", "hold", "heading_error_final_deg", at_most=True),
    Finding("first second: surge force, peak", 3.1e7, " N", "circle", "surge_force_peak"),
    Finding("first second: surge force, peak, as an acceleration", 26.0, " g", "circle", "surge_peak_in_g"),
    Finding("first second: yaw moment, peak", 1.5e9, " N·m", "circle", "yaw_moment_peak"),
)
