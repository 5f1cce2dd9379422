"""Writes what an identification has found as a vessel file, which scenarios name."""

from collections.abc import Mapping, Sequence

import numpy as np
import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.version import __version__
from vessel_hsmc_ros.identification.types import Identified, Measurements
from vessel_hsmc_ros.scenario.parameters_file import tree

LIMITS = {"surge_force_limit": 0, "yaw_moment_limit": 2}
"""Limits of the propulsion with their columns of the wrench."""

PREFIX = "vessel."


def vessel_text(
    name: str, found: Identified, runs: Sequence[Measurements], known: Mapping[str, object], errors: Mapping[str, str]
) -> str:
    """Write a vessel file in the format of the library.

    Args:
        name: Name of the vessel.
        found: The identification.
        runs: The runs that it has used.
        known: What is known of the ship besides, by the names in a vessel file: length, beam, limits, thrusters and so on.
        errors: Root mean square prediction errors on held-out runs, with their units; empty without.

    Raises:
        ParameterError: length or beam is not known.
    """
    for needed in ("length", "beam"):
        if needed not in known:
            raise ParameterError(f"the {needed} of the ship is not known: it takes --vessel START, or --{needed}")
    largest = {key: float(np.nanmax(np.abs(np.concatenate([run.wrench[:, i] for run in runs])))) for key, i in LIMITS.items()}
    hull = {key: _digits(value) for key, value in found.vessel_values().items()}
    document = {
        "name": name,
        "description": f"Identified from {', '.join(run.name for run in runs)}.",
        "source": {
            "citation": f"identified from recorded motion by vessel_hsmc_ros {__version__}, model {found.model.name}",
            "table": ", ".join(run.name for run in runs),
        },
        "checks": {
            "verified": [f"{key} on held-out data: {value}" for key, value in errors.items()],
            "unverified": [f"{key} is held: {why}" for key, why in found.unidentifiable],
        },
        "vessel": {**{key: _digits(value) for key, value in largest.items() if value > 0.0}, **known, **hull},
    }
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)


def known_of(values: Mapping[str, object], estimated: Mapping[str, float]) -> dict[str, object]:
    """What a start vessel states beyond the estimates, nested as in a vessel file.

    Args:
        values: Its values by their dotted names in a scenario, `vessel.length`.
        estimated: Hull parameters that come from the identification instead.
    """
    replaced = {*estimated, "surge_speed_range", "sway_speed_range", "yaw_rate_range", "name"}
    own = {name.removeprefix(PREFIX): value for name, value in values.items() if name.startswith(PREFIX)}
    return tree({name: value for name, value in own.items() if name not in replaced})


def _digits(value: float | list[float]) -> float | list[float]:
    """Numbers with six digits."""
    return [float(f"{each:.6g}") for each in value] if isinstance(value, list) else float(f"{value:.6g}")
