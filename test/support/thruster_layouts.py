"""Layouts of thrusters for tests, of every kind."""

import math
from typing import Any

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout

LAYOUTS: dict[str, dict[str, Any]] = {
    "twin": {
        "names": ["left", "right"],
        **{"x": [-2.0], "y": [0.395, -0.395], "thrust_ahead": [119.7], "thrust_astern": [66.7]},
    },
    "bow_thruster": {
        "names": ["left", "right", "bow"],
        **{"x": [-0.5, -0.5, 0.466], "y": [0.078, -0.078, 0.0], "angle": [0.0, 0.0, 0.5 * math.pi]},
        **{"thrust_ahead": [4.1, 4.1, 0.5], "thrust_astern": [5.7, 5.7, 0.5]},
    },
    "four": {
        "names": ["a", "b", "c", "d"],
        **{"x": [2.0, 2.0, -2.0, -2.0], "y": [0.8, -0.8, 0.8, -0.8], "angle": [-0.8, 0.8, 0.8, -0.8]},
        **{"thrust_ahead": [100.0, 80.0, 100.0, 120.0], "thrust_astern": [60.0, 80.0, 50.0, 0.0]},
    },
    "azimuths": {"names": ["fore", "aft"], "kinds": ["azimuth"], "x": [1.8, -1.8], "thrust_ahead": [500.0, 400.0]},
    "outboard": {
        "names": ["jet"],
        "kinds": ["azimuth"],
        **{"x": [-4.0], "angle_limit": [0.47], "thrust_ahead": [13100.0], "thrust_astern": [6550.0]},
    },
    "outboards": {
        "names": ["left", "right"],
        "kinds": ["azimuth"],
        **{"x": [-3.0], "y": [0.6, -0.6], "angle_limit": [0.5], "thrust_ahead": [1000.0], "thrust_astern": [400.0]},
    },
    "rudder": {
        "names": ["screw"],
        "kinds": ["rudder"],
        **{"x": [-4.0], "angle_limit": [0.6], "thrust_ahead": [1000.0], "thrust_astern": [600.0]},
        **{"lift": [60.0], "lift_quadratic": [30.0], "slipstream": [0.003]},
    },
    "rudder_and_bow_thruster": {
        "names": ["screw", "bow"],
        "kinds": ["rudder", "fixed"],
        **{"x": [-4.0, 3.0], "angle": [0.0, 0.5 * math.pi], "angle_limit": [0.6]},
        **{"thrust_ahead": [1000.0, 100.0], "thrust_astern": [600.0, 100.0]},
        **{"lift": [60.0], "lift_quadratic": [30.0], "slipstream": [0.003]},
    },
}


def layout_of(name: str, **changes: Any) -> ThrusterLayout:
    return schema.build(ThrusterLayout, {**LAYOUTS[name], **changes}, "vessel.thrusters")


def layout(name: str) -> dict[str, Any]:
    """The parameters of a node for a layout, as keyword arguments."""
    return {f"vessel__thrusters__{key}": value for key, value in LAYOUTS[name].items()}
