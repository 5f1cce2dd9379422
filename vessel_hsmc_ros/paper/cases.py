"""The runs that reproduce the paper: its cases as printed, and variations that explain their results."""

from collections.abc import Mapping
from dataclasses import dataclass, field

CALM: Mapping[str, object] = {
    "vessel_sim.disturbance.periodic.surge_force": 0.0,
    "vessel_sim.disturbance.periodic.sway_force": 0.0,
    "vessel_sim.disturbance.periodic.yaw_moment": 0.0,
}
NO_LEARNING: Mapping[str, object] = {
    "controller.hierarchical.sway_adaptation_gain": 0.0,
    "controller.hierarchical.yaw_adaptation_gain": 0.0,
    "controller.hierarchical.surge_adaptation_gain": 0.0,
}

LEARNING: Mapping[str, object] = {
    "controller.hierarchical.sway_adaptation_gain": 0.01,
    "controller.hierarchical.surge_adaptation_gain": 1.0,
}


def switching(gain: float) -> Mapping[str, object]:
    """Set both switching gains to one value."""
    return {f"controller.hierarchical.{name}_switching_gain": gain for name in ("yaw", "surge")}


def slopes(slope: float) -> Mapping[str, object]:
    """Set the slopes c1, c2, c3 of the surfaces to one value."""
    return {f"controller.hierarchical.{name}_surface_slope": slope for name in ("sway", "heading", "surge")}


def damping(factor: float) -> Mapping[str, object]:
    """Multiply the plant's linear damping by a factor; the virtual ship keeps its own."""
    # The linear damping of section 6.2.
    values = {"surge": 215e2, "sway": 147e3, "yaw": 802e4}
    return {f"vessel_sim.vessel.{name}_damping": factor * value for name, value in values.items()}


@dataclass(frozen=True)
class Case:
    """A run that the reproduction needs.

    Attributes:
        name: Key by which claims, errata and figures refer to it.
        title: What it shows.
        scenario: Scenario it is derived from.
        changes: Changed values by `node.parameter`.
        exact: Replace the networks by the exact model of the ship; offline only.
        rate_hz: Run all nodes at this rate although the law is unstable there; offline only.
        ends: The run is expected to diverge before its end; offline only.
    """

    name: str
    title: str
    scenario: str
    changes: Mapping[str, object] = field(default_factory=dict)
    exact: bool = False
    rate_hz: float = 0.0
    ends: bool = False

    @property
    def by_nodes(self) -> bool:
        """Whether the nodes can run it."""
        return not (self.exact or self.rate_hz or self.ends)


SHORT: Mapping[str, object] = {"vessel_sim.duration": 60.0}
TRACKING, STRAIGHT, SLALOM = "case2_tracking", "case2_straight", "case2_slalom"
LIMITS: Mapping[str, object] = {
    "vessel_sim.actuators.surge_force_limit": 2e5,
    "vessel_sim.actuators.yaw_moment_limit": 3e6,
}
SWAY_WEIGHT = "controller.hierarchical.sway_weight"
ETA_OF_34 = 2.0

CASES: tuple[Case, ...] = (
    Case("course", "course, sliding mode and networks, calm", "case1_course"),
    Case("course_disturbed", "course, sliding mode and networks, disturbed", "case1_course_disturbed"),
    Case("course_pd", "course, PD, calm", "case1_pd"),
    Case("course_pd_disturbed", "course, PD, disturbed", "case1_pd_disturbed"),
    Case("circle", "circle, disturbed: the paper's case 2", TRACKING),
    Case("straight", "straight line, disturbed", STRAIGHT),
    Case("slalom", "slalom, disturbed", SLALOM),
    Case("stabilisation", "stabilisation, disturbed: the paper's case 3", "case3_stabilisation"),
    Case("stabilisation_calm", "stabilisation, calm", "case3_calm"),
    Case("circle_calm", "circle, calm", TRACKING, CALM),
    Case("straight_calm", "straight line, calm", STRAIGHT, CALM),
    Case("slalom_long", "slalom, disturbed, 800 s", SLALOM, {"vessel_sim.duration": 800.0}),
    Case(
        "course_disturbed_no_learning",
        "course, sliding mode, adaptation gain 0, disturbed",
        "case1_course_disturbed",
        {"controller.course.adaptation_gain": 0.0},
    ),
    Case("circle_no_learning", "circle, adaptation gains 0", TRACKING, NO_LEARNING),
    Case("circle_learning", "circle, networks of f_u and f_v that learn faster", TRACKING, LEARNING),
    Case(
        "circle_as_printed",
        "circle, adaptation by (29) as printed",
        TRACKING,
        {"controller.hierarchical.adaptation": "as_printed"},
        ends=True,
    ),
    Case(
        "circle_switched",
        "circle, a of switching sign",
        TRACKING,
        {"controller.hierarchical.sway_weight_sign": "switched"},
    ),
    Case("circle_weak_hull", "circle, the ship's linear damping halved", TRACKING, damping(0.5)),
    Case("circle_stiff_hull", "circle, the ship's linear damping times 1.5", TRACKING, damping(1.5)),
    Case("circle_limited", "circle, actuators limited to 2e5 N and 3e6 N·m", TRACKING, LIMITS),
    Case("circle_60", "circle, 60 s", TRACKING, SHORT),
    Case("circle_steep", "circle, 60 s, slopes c doubled", TRACKING, {**SHORT, **slopes(0.6)}),
    Case("circle_switching", "circle, 60 s, switching gains of 2", TRACKING, {**SHORT, **switching(ETA_OF_34)}),
    Case("circle_no_learning_60", "circle, 60 s, adaptation gains 0", TRACKING, {**SHORT, **NO_LEARNING}),
    Case(
        "circle_no_learning_switching",
        "circle, 60 s, adaptation gains 0, switching gains of 2",
        TRACKING,
        {**SHORT, **NO_LEARNING, **switching(ETA_OF_34)},
    ),
    Case("circle_exact", "circle, the ship known exactly", TRACKING, exact=True),
    Case("straight_exact", "straight line, the ship known exactly", STRAIGHT, exact=True),
    Case("slalom_exact", "slalom, the ship known exactly", SLALOM, exact=True),
    Case("circle_exact_calm", "circle, the ship known exactly, calm", TRACKING, CALM, exact=True),
    Case("straight_a_0.1", "straight line, a = 0.1", STRAIGHT, {SWAY_WEIGHT: 0.1, "vessel_sim.duration": 800.0}, ends=True),
    Case("straight_a_1", "straight line, a = 1", STRAIGHT, {SWAY_WEIGHT: 1.0}, ends=True),
    Case("circle_50_hz", "circle at 50 Hz, reaching gain times period 2", TRACKING, rate_hz=50.0, ends=True),
    Case("circle_60_hz", "circle at 60 Hz, reaching gain times period 1.67", TRACKING, SHORT, rate_hz=60.0, ends=True),
)
