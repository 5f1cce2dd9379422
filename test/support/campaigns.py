"""Small campaigns for tests."""

from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.studies.campaign.plan import Campaign

INERTIA = "controller.vessel.surge_inertia"
X = "vessel_sim.initial_pose[0]"
FORCE = "vessel_sim.disturbance.earth_fixed.east_force"
SEED = "vessel_sim.seed"


def entries(**changes: object) -> dict[str, object]:
    """The entries of a campaign file: 5 draws of half a second for two laws, in chunks of 4 runs; None leaves an entry out."""
    given: dict[str, object] = {
        "scenario": "case2_tracking",
        "set": {"vessel_sim.duration": 0.5},
        "laws": ["los_pid", "hierarchical_printed"],
        "runs": 5,
        "seed": 1,
        "chunk": 4,
        "draw": {INERTIA: {"uniform": [0.8, 1.2], "relative": True}, X: {"normal": [5.0, 1.0]}},
        **changes,
    }
    return {key: value for key, value in given.items() if value is not None}


def campaign_file(folder: Path, name: str = "small", **changes: Any) -> Path:
    """Write the file of a small campaign."""
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(entries(**changes), sort_keys=False))
    return path


def campaign(folder: Path, **changes: Any) -> Campaign:
    """A small campaign."""
    return Campaign.load(campaign_file(folder, **changes))
