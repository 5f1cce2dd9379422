"""Claims of the paper's stability proof (section 5): switching gains, Lyapunov function, convergence of the errors."""

from vessel_hsmc_ros.paper.checks import Check, Claim
from vessel_hsmc_ros.paper.thresholds import CONVERGED, CONVERGED_DEG

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
