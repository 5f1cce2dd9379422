"""Every claim of the paper that a run can test, in the paper's order.

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode.

The paper gives no numbers for its claims. The thresholds are ours and generous: the ship is some 30 m long and starts 17 m off
its reference.
"""

from vessel_hsmc_ros.paper.cases import ADAPTATION_GAINS, ETA_OF_34, course_learning
from vessel_hsmc_ros.paper.checks import Check, Claim

# 2·pi/0.05 rad/s, rounded.
CYCLE = 126.0
"""Period of case 1's reference, s."""

CLOSE = 1.0
"""A ship tracks its reference if the position error, m, and the heading error, degrees, stay below this."""

CONVERGED, CONVERGED_DEG = 0.1, 0.1
"""An error below this has converged to zero, m and degrees."""

FORCE_LIMIT, MOMENT_LIMIT = 2e5, 3e6
"""What the actuators of such a ship could deliver, N and N·m: twice the force and three times the moment that case 2 needs."""


def close(run: str, label: str) -> Check:
    """The position error of a run stays below CLOSE."""
    return Check(f"{label}, position error", run, "position_error_late", below=CLOSE, unit=" m")


def heading_close(run: str, label: str) -> Check:
    """The heading error of a run stays below CLOSE."""
    return Check(f"{label}, heading error", run, "heading_error_late_deg", below=CLOSE, unit="°")


TRAJECTORIES = (close("circle", "circle"), close("straight", "straight line"), close("slalom_long", "slalom"))
"""All trajectories of the paper are tracked."""


LEARNING_CIRCLES = ("circle_learning_10", "circle_learning", "circle_learning_faster")
"""The circle with larger adaptation gains than those of the scenario."""

SETS = "of (f_v, f_r, f_u) = all 0.001, all 0.01, (0.01, 0.001, 1), (1, 0.02, 10)"
"""The adaptation gains of the circle and of LEARNING_CIRCLES, 1/s."""

ABSTRACT = (
    Claim(
        "abstract",
        "one controller tracks and stabilises at once",
        (close("circle", "circle"), close("stabilisation", "stabilisation")),
    ),
    Claim(
        "abstract",
        "hierarchical surfaces deal with the missing actuator",
        (
            heading_close("circle", "circle"),
            Check("lateral error", "circle", "sway_error_late", below=CLOSE, unit=" m"),
        ),
    ),
    Claim(
        "abstract, 2.1",
        "the networks approximate the unknown functions",
        tuple(
            Check(
                f"circle, relative error of {name}, γ {SETS}, the last over 120 s",
                "circle",
                f"{axis}_estimate_error",
                below=0.1,
                also=(*LEARNING_CIRCLES, "circle_learning_120"),
            )
            for name, axis in (("f_u", "surge"), ("f_v", "sway"), ("f_r", "yaw"))
        ),
        remark="f_u and f_r are learnt at the start with large γ; f_v at no γ",
    ),
    Claim(
        "abstract",
        "the networks make the controller more robust in heading",
        (
            Check(
                f"course disturbed, heading error with γ = 0.001, {', '.join(f'{gain:g}' for gain in ADAPTATION_GAINS)} "
                "relative to that without learning:",
                "course_disturbed",
                "heading_error_second_half_deg",
                below=0.5,
                over=("course_disturbed_no_learning", "heading_error_second_half_deg"),
                also=tuple(map(course_learning, ADAPTATION_GAINS)),
            ),
        ),
        remark="depends on γ: not with the 0.001 of the scenario, from 0.1 on",
    ),
    Claim(
        "abstract",
        "the networks make the controller more robust in position",
        (
            Check(
                f"circle, position error with γ {SETS} relative to that without learning:",
                "circle",
                "position_error_late",
                below=0.5,
                over=("circle_no_learning", "position_error_late"),
                also=LEARNING_CIRCLES,
            ),
        ),
    ),
    Claim(
        "abstract",
        "the chattering of sliding mode is reduced",
        (
            Check(
                "change of the moment per period, relative to plain sliding mode with sufficient switching gains",
                "circle_60",
                "yaw_moment_step",
                below=0.1,
                over=("circle_no_learning_switching", "yaw_moment_step"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "it is the networks that reduce the chattering",
        (
            Check(
                "change of the moment per period with learning, relative to that without",
                "circle_60",
                "yaw_moment_step",
                below=0.5,
                over=("circle_no_learning_60", "yaw_moment_step"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "the non-linear damping matters and is taken into account",
        (Check("straight line, its share of the surge damping", "straight", "nonlinear_damping_share", above=0.1),),
    ),
    Claim(
        "abstract, 5, 8",
        "the closed loop is stable",
        tuple(
            Check(
                f"{words}, position error of the last quarter relative to the second",
                run,
                "position_error_late",
                below=1.05,
                over=(run, "position_error_second_quarter"),
            )
            for run, words in (("circle", "circle"), ("stabilisation", "stabilisation"))
        ),
    ),
)

INTRODUCTION = (
    Claim(
        "introduction",
        "the controller is simple and needs little computation",
        (Check("stored numbers", "circle", "weights", below=1000.0),),
    ),
    Claim(
        "introduction",
        "it is suitable for practice",
        (
            Check("surge force, peak", "circle", "surge_force_peak", below=FORCE_LIMIT, unit=" N"),
            Check("yaw moment, peak", "circle", "yaw_moment_peak", below=MOMENT_LIMIT, unit=" N·m"),
        ),
    ),
    Claim(
        "introduction",
        "it is robust to model uncertainty",
        (close("circle_weak_hull", "damping × 0.5"), close("circle_stiff_hull", "damping × 1.5")),
    ),
    Claim(
        "introduction",
        "the ship tracks any kind of trajectory very well",
        TRAJECTORIES,
    ),
    Claim("introduction", "a straight line can be tracked, without persistent excitation", (close("straight", "straight line"),)),
)

PROBLEM = (
    Claim(
        "3, assumption 1",
        "the exact form of the ship's model is not needed",
        (
            Check(
                "circle, position error relative to that with the model known",
                "circle",
                "position_error_late",
                below=1.1,
                over=("circle_exact", "position_error_late"),
            ),
        ),
        remark="compares two lost runs: neither stays on the circle",
    ),
    Claim(
        "3, (11)",
        "tracking with z_d = 0 is stabilisation",
        (
            close("stabilisation_calm", "calm"),
            Check("surge force, change per period", "stabilisation_calm", "surge_force_step", below=FORCE_LIMIT, unit=" N"),
        ),
    ),
)


STABILITY = (
    Claim(
        "5, (34)",
        "eta1 exceeds the bound set by disturbance and network errors",
        (
            Check(
                "eta1 relative to its lower bound",
                "circle",
                "yaw_switching_gain",
                above=1.0,
                over=("circle", "yaw_switching_gain_needed"),
            ),
        ),
    ),
    Claim(
        "5, (34)",
        "eta2 exceeds the bound set by disturbance and network errors",
        (
            Check(
                "eta2 relative to its lower bound",
                "circle",
                "surge_switching_gain",
                above=1.0,
                over=("circle", "surge_switching_gain_needed"),
            ),
        ),
    ),
    Claim(
        "5, (35)",
        "V never increases",
        (
            Check(
                "circle with the model known, where V is V_S: fraction of the periods in which it increases",
                "circle_exact",
                "lyapunov_rising_share",
                below=0.01,
            ),
        ),
        remark="it increases where the surfaces are at 1e-4 of their start or below",
    ),
    *(
        Claim(
            "5, (40)",
            f"{symbol} converges to zero",
            (
                Check(
                    "circle, last quarter relative to the start",
                    "circle",
                    f"{axis}_surface_late",
                    below=0.01,
                    over=("circle", f"{axis}_surface_start"),
                ),
            ),
        )
        for symbol, axis in (("S1", "yaw"), ("S2", "surge"))
    ),
    Claim("5, (42)", "z1e converges to zero", (Check("circle, z1e", "circle", "surge_error_late", below=CONVERGED, unit=" m"),)),
    Claim("5, (45)", "z2e converges to zero", (Check("circle, z2e", "circle", "sway_error_late", below=CONVERGED, unit=" m"),)),
    Claim(
        "5, (45)",
        "z3e converges to zero",
        (Check("circle, z3e", "circle", "heading_error_late_deg", below=CONVERGED_DEG, unit="°"),),
    ),
    Claim(
        "5, (46)",
        "a·sigma1 = -b·sigma2 does not happen unless both are zero",
        (
            Check(
                "circle with the model known, calm, S1 relative to a·sigma1",
                "circle_exact_calm",
                "yaw_surface_late",
                above=0.1,
                over=("circle_exact_calm", "weighted_sway_surface_late"),
            ),
        ),
    ),
)


SUFFICIENT = f"circle_switching_{ETA_OF_34:g}"
"""The circle with switching gains that meet (34)."""

SIMULATIONS = (
    Claim(
        "6.1, Fig. 1",
        "sliding mode and networks converge quickly",
        (Check("settling time to 1°", "course", "heading_settling_time", below=0.1 * CYCLE, unit=" s"),),
    ),
    Claim(
        "6.1, Fig. 1",
        "PD needs almost one cycle",
        (Check("settling time to 1°", "course_pd", "heading_settling_time", above=0.5 * CYCLE, below=CYCLE, unit=" s"),),
        by_construction=True,
        remark="the paper gives no PD gains; ours were chosen to do this, and stiffer ones settle within a tenth of a cycle",
    ),
    Claim("6.1, Fig. 2", "sliding mode and networks still work when disturbed", (heading_close("course_disturbed", "course"),)),
    Claim(
        "6.1, Fig. 2",
        "PD almost loses the track when disturbed",
        (
            Check(
                "heading error relative to the oscillation of the reference",
                "course_pd_disturbed",
                "heading_error_second_half_deg",
                above=0.5,
                over=("course_pd_disturbed", "heading_reference_second_half_deg"),
            ),
        ),
        by_construction=True,
        remark="as above; stiffer gains keep the track",
    ),
    Claim(
        "6.2, remark",
        "steeper surfaces (larger c) are reached earlier",
        tuple(
            Check(
                f"time to reach {symbol} with c doubled, relative to the printed c",
                "circle_steep",
                f"{axis}_surface_reaching_time",
                below=0.9,
                over=("circle_60", f"{axis}_surface_reaching_time"),
            )
            for symbol, axis in (("S1", "yaw"), ("S2", "surge"))
        ),
    ),
    Claim(
        "6.2, remark",
        "steeper surfaces (larger c) respond faster",
        (
            Check(
                "settling time of the heading with c doubled, relative to the printed c",
                "circle_steep",
                "heading_settling_time",
                below=0.9,
                over=("circle_60", "heading_settling_time"),
            ),
        ),
    ),
    Claim(
        "6.2, remark",
        "larger eta makes the controller more robust",
        tuple(
            Check(
                f"circle, {symbol} with eta = 0.1, {ETA_OF_34:g}, 2, relative to the printed eta:",
                "circle_switching_0.1",
                f"{axis}_surface_late",
                below=0.9,
                over=("circle_60", f"{axis}_surface_late"),
                also=(SUFFICIENT, "circle_switching_2"),
            )
            for symbol, axis in (("S1", "yaw"), ("S2", "surge"))
        ),
        remark="S2 falls, S1 not enough; the lateral error stays",
    ),
    Claim(
        "6.2, remark",
        "larger eta causes chattering",
        (
            Check(
                f"circle, change of the moment per period with eta = {ETA_OF_34:g}, relative to the printed eta",
                SUFFICIENT,
                "yaw_moment_step",
                above=10.0,
                over=("circle_60", "yaw_moment_step"),
            ),
        ),
    ),
    Claim("6.2, Fig. 3", "the track agrees well with the desired one", (close("circle", "circle"),)),
    Claim(
        "6.2, Fig. 4",
        "the velocities follow their references",
        (
            Check("circle, surge", "circle", "surge_velocity_error_late", below=0.1, unit=" m/s"),
            Check("sway", "circle", "sway_velocity_error_late", below=0.1, unit=" m/s"),
        ),
    ),
    Claim("6.2, Fig. 5", "heading and yaw rate follow their references", (heading_close("circle", "circle"),)),
    Claim(
        "6.2, Figs. 3 to 6",
        "the controllers are robust to the disturbance",
        TRAJECTORIES,
    ),
    Claim("7, Fig. 7", "it stabilises well when disturbed", (close("stabilisation", "stabilisation"),)),
    Claim("7, Fig. 9", "the heading is held when disturbed", (heading_close("stabilisation", "stabilisation"),)),
)


CLAIMS = (*ABSTRACT, *INTRODUCTION, *PROBLEM, *STABILITY, *SIMULATIONS)
