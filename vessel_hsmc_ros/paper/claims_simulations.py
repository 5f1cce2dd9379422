"""Claims that the paper draws from its simulations (sections 6 and 7)."""

from vessel_hsmc_ros.paper.cases import ETA_OF_34
from vessel_hsmc_ros.paper.checks import Check, Claim
from vessel_hsmc_ros.paper.thresholds import CYCLE, TRAJECTORIES, close, heading_close

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
