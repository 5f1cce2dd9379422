"""Help on the diagrams of a report, by their titles: what each one shows, and what is good."""

_NETWORK = (
    "What the law's network has learnt, beside the truth: the acceleration by hydrodynamic forces and disturbance together,"
    " without the actuators. Good: the estimate follows the truth."
)
_DEVIATION = (
    "Difference between the measured or estimated value and the true one. Good: the estimate is closer than the measurement."
)
_VELOCITY = "Velocity of the ship and of its reference. Good: both are equal after the transient."
_DISTURBANCE = "Acceleration by wind, waves and periodic loads; the law does not know it."
_SURFACE = "Sliding surfaces of the law: combinations of errors and their rates. Good: they reach zero and stay there."

HELP = {
    "position error": "Distance between ship and reference. Good: it falls to a small value and stays there.",
    "position error in the body frame": (
        "Position of the ship relative to the reference, along the ship's axes: positive is ahead of the reference, or to port"
        " of it. Good: both are near zero."
    ),
    "cross-track error": (
        "Distance of the ship from the planned leg or turn, positive to port of it. Good: near zero on the legs; it does not"
        " depend on the motion of the reference."
    ),
    "along-track error": "Way by which the ship is ahead of the plan along its leg or turn. Good: near zero.",
    "heading error": (
        "Heading of the ship minus that of the reference, positive counter-clockwise. Good: near zero; a ship without a sway"
        " actuator may need a constant angle against current or wind."
    ),
    **dict.fromkeys(("surge velocity", "sway velocity", "yaw rate"), _VELOCITY),
    **dict.fromkeys(("position, deviation from the truth", "heading, deviation from the truth"), _DEVIATION),
    "z_e of (11)": (
        "Error variables of the paper: differences of positions that are each resolved in their own ship's frame. They depend on"
        " the origin of the coordinates and may be large while the ship is on its reference."
    ),
    "surge and sway surfaces": _SURFACE,
    "yaw and heading surfaces": _SURFACE,
    "Lyapunov function": "The measurable part of the Lyapunov function, (S₁² + S₂²)/2. Good: it decreases to zero.",
    "Lyapunov function, time derivative": "Rate of the Lyapunov function. Good: negative until the surfaces are reached.",
    "surge force": "Force of the propeller. Good: smooth, and within the limits, which are drawn if the values come near them.",
    "yaw moment": "Moment of the rudder. Good: smooth, and within the limits, which are drawn if the values come near them.",
    "surge dynamics f_u and disturbance": _NETWORK,
    "sway dynamics f_v and disturbance": _NETWORK,
    "yaw dynamics f_r and disturbance": _NETWORK,
    "weight norms": "Size of the weights of each network. Good: they approach constant values.",
    **dict.fromkeys(("surge disturbance", "sway disturbance", "yaw disturbance"), _DISTURBANCE),
    "computation time of the law": "Time that one update of the law took on this machine. Good: far below the control period.",
    "control interval": "Time between two updates of the law, without pauses. Good: close to the control period.",
}
