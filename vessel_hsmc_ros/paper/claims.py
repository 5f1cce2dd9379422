"""Every claim of the paper that a run can test, in the paper's order.

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode. The
thresholds are ours, and meant to be kind: the ship is some 30 m long and starts 17 m off its reference.
"""

from vessel_hsmc_ros.paper.checks import Check, Claim

CYCLE = 126.0
"""Period of case 1's reference, s."""

CLOSE = 1.0
"""A ship this close to its reference tracks it, m; likewise its heading, degrees."""

GONE, GONE_DEG = 0.1, 0.1
"""An error below this has gone to zero, m and degrees."""

FORCE_LIMIT, MOMENT_LIMIT = 2e5, 3e6
"""What this ship's actuators could give, N and N·m: twice the force and three times the moment that case 2 needs."""


def close(run: str, words: str) -> Check:
    """The ship is close to its reference."""
    return Check(f"{words}, position error", run, "position_error_late", below=CLOSE, unit=" m")


def heading_close(run: str, words: str) -> Check:
    """The ship's heading is close to its reference's."""
    return Check(f"{words}, heading error", run, "heading_error_late_deg", below=CLOSE, unit="°")


TRAJECTORIES = (close("circle", "circle"), close("straight", "straight line"), close("slalom_long", "slalom"))

ABSTRACT = (
    Claim(
        "abstract", "one controller tracks and stabilises at once", (close("circle", "circle"), close("hold", "stabilisation"))
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
            Check(f"circle, relative error of {name}", "circle", f"{axis}_estimate_error", below=0.1)
            for name, axis in (("f_u", "surge"), ("f_v", "sway"), ("f_r", "yaw"))
        ),
    ),
    Claim(
        "abstract",
        "the networks make the controller more robust in heading",
        (
            Check(
                "course disturbed, heading error with over without learning",
                "course_pushed",
                "heading_error_second_half_deg",
                below=0.5,
                over=("course_pushed_unlearnt", "heading_error_second_half_deg"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "the networks make the controller more robust in position",
        (
            Check(
                "circle, position error with over without learning",
                "circle",
                "position_error_late",
                below=0.5,
                over=("circle_unlearnt", "position_error_late"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "the chattering of sliding mode is relieved",
        (
            Check(
                "jumps of the moment, over those of a plain sliding mode whose switching gains suffice",
                "circle_60",
                "yaw_moment_step",
                below=0.1,
                over=("circle_unlearnt_switching", "yaw_moment_step"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "it is the networks that relieve the chattering",
        (
            Check(
                "jumps of the moment with over without learning",
                "circle_60",
                "yaw_moment_step",
                below=0.5,
                over=("circle_unlearnt_60", "yaw_moment_step"),
            ),
        ),
    ),
    Claim(
        "abstract",
        "the non-linear damping matters and is taken into account",
        (Check("straight, its share of the surge damping", "straight", "nonlinear_damping_share", above=0.1),),
    ),
    Claim(
        "abstract, 5, 8",
        "the closed loop is stable",
        tuple(
            Check(
                f"{words}, position error in the last over the second quarter",
                run,
                "position_error_late",
                below=1.05,
                over=(run, "position_error_second_quarter"),
            )
            for run, words in (("circle", "circle"), ("hold", "stabilisation"))
        ),
    ),
)

INTRODUCTION = (
    Claim(
        "introduction",
        "the controller is simple, with little to compute",
        (Check("numbers to remember", "circle", "weights", below=1000.0),),
    ),
    Claim(
        "introduction",
        "it is fit for practice",
        (
            Check("surge force, peak", "circle", "surge_force_peak", below=FORCE_LIMIT, unit=" N"),
            Check("yaw moment, peak", "circle", "yaw_moment_peak", below=MOMENT_LIMIT, unit=" N·m"),
        ),
    ),
    Claim(
        "introduction",
        "it is robust to uncertainties of the ship",
        (close("circle_weak_hull", "damping × 0.5"), close("circle_stiff_hull", "damping × 1.5")),
    ),
    Claim(
        "introduction",
        "the ship follows whatever kind of trajectory very well",
        TRAJECTORIES,
    ),
    Claim("introduction", "a straight line can be tracked, without persistent excitation", (close("straight", "straight"),)),
)

PROBLEM = (
    Claim(
        "3, assumption 1",
        "the exact form of the ship's model does not matter",
        (
            Check(
                "circle, position error over that with the model known",
                "circle",
                "position_error_late",
                below=1.1,
                over=("circle_exact", "position_error_late"),
            ),
        ),
    ),
    Claim(
        "3, (11)",
        "tracking with z_d = 0 is stabilisation",
        (
            close("hold_calm", "calm"),
            Check("surge force, jumps at rest", "hold_calm", "surge_force_step", below=FORCE_LIMIT, unit=" N"),
        ),
    ),
)
