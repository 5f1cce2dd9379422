"""What the paper proves and what it shows in its figures, as claims; the rest of `claims`."""

from vessel_hsmc_ros.paper.checks import Check, Claim
from vessel_hsmc_ros.paper.claims import (
    ABSTRACT,
    CYCLE,
    GONE,
    GONE_DEG,
    INTRODUCTION,
    PROBLEM,
    TRAJECTORIES,
    close,
    heading_close,
)

PROOF = (
    Claim(
        "5, (34)",
        "eta1 exceeds what disturbance and networks ask for",
        (
            Check(
                "eta1 over the least it takes",
                "circle",
                "yaw_switching_gain",
                above=1.0,
                over=("circle", "yaw_switching_gain_needed"),
            ),
        ),
    ),
    Claim(
        "5, (34)",
        "eta2 exceeds what disturbance and networks ask for",
        (
            Check(
                "eta2 over the least it takes",
                "circle",
                "surge_switching_gain",
                above=1.0,
                over=("circle", "surge_switching_gain_needed"),
            ),
        ),
    ),
    Claim(
        "5, (35)",
        "V never rises",
        (
            Check(
                "circle with the model known, where V is V_S: share of the periods in which it rises",
                "circle_exact",
                "lyapunov_rising_share",
                below=0.01,
            ),
        ),
    ),
    *(
        Claim(
            "5, (40)",
            f"{symbol} goes to zero",
            (
                Check(
                    "circle, last quarter over the start",
                    "circle",
                    f"{axis}_surface_late",
                    below=0.01,
                    over=("circle", f"{axis}_surface_start"),
                ),
            ),
        )
        for symbol, axis in (("S1", "yaw"), ("S2", "surge"))
    ),
    Claim("5, (42)", "z1e goes to zero", (Check("circle, z1e", "circle", "surge_error_late", below=GONE, unit=" m"),)),
    Claim("5, (45)", "z2e goes to zero", (Check("circle, z2e", "circle", "sway_error_late", below=GONE, unit=" m"),)),
    Claim("5, (45)", "z3e goes to zero", (Check("circle, z3e", "circle", "heading_error_late_deg", below=GONE_DEG, unit="°"),)),
    Claim(
        "5, (46)",
        "a·sigma1 = -b·sigma2 does not happen unless both are zero",
        (
            Check(
                "circle with the model known, calm, S1 over a·sigma1",
                "circle_exact_calm",
                "yaw_surface_late",
                above=0.1,
                over=("circle_exact_calm", "weighted_sway_surface_late"),
            ),
        ),
    ),
)

FIGURES = (
    Claim(
        "6.1, Fig. 1",
        "sliding mode and networks converge quickly",
        (Check("time to stay below 1°", "course", "heading_settling_time", below=0.1 * CYCLE, unit=" s"),),
    ),
    Claim(
        "6.1, Fig. 1",
        "PD needs almost one cycle",
        (Check("time to stay below 1°", "course_pd", "heading_settling_time", above=0.5 * CYCLE, below=CYCLE, unit=" s"),),
    ),
    Claim("6.1, Fig. 2", "sliding mode and networks still work when disturbed", (heading_close("course_pushed", "course"),)),
    Claim(
        "6.1, Fig. 2",
        "PD almost loses the track when disturbed",
        (
            Check(
                "heading error over the reference's own swing",
                "course_pd_pushed",
                "heading_error_second_half_deg",
                above=0.5,
                over=("course_pd_pushed", "heading_reference_second_half_deg"),
            ),
        ),
    ),
    Claim(
        "6.2, remark",
        "steeper surfaces (larger c) are reached sooner",
        tuple(
            Check(
                f"time to reach {symbol} with c doubled over before",
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
                "time to settle in heading, c doubled over before",
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
        (
            Check(
                "circle, S1 with eta = 2 over before",
                "circle_switching",
                "yaw_surface_late",
                below=0.9,
                over=("circle_60", "yaw_surface_late"),
            ),
        ),
    ),
    Claim(
        "6.2, remark",
        "larger eta causes chattering",
        (
            Check(
                "circle, jumps of the moment with eta = 2 over before",
                "circle_switching",
                "yaw_moment_step",
                above=10.0,
                over=("circle_60", "yaw_moment_step"),
            ),
        ),
    ),
    Claim("6.2, Fig. 3", "the track fits the desired one quite well", (close("circle", "circle"),)),
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
    Claim("7, Fig. 7", "it stabilises well when disturbed", (close("hold", "stabilisation"),)),
    Claim("7, Fig. 9", "the heading is held when disturbed", (heading_close("hold", "stabilisation"),)),
)

CLAIMS = (*ABSTRACT, *INTRODUCTION, *PROBLEM, *PROOF, *FIGURES)
"""All claims, in the paper's order."""
