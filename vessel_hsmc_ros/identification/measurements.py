"""Measurements from runs, bags and CSV files."""

from collections.abc import Mapping
from pathlib import Path

from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.identification.types import Measurements


def from_run(run: Run, name: str = "run") -> Measurements:
    """The measured motion and the applied wrench of a run."""
    raise NotImplementedError


def from_bag(path: Path, namespace: str | None = None) -> Measurements:
    """Odometry with the applied wrench, or the commanded one where the bag has no other, at the odometry's stamps.

    Args:
        path: A bag or a run folder.
        namespace: Of the vessel, where the bag has several.

    Raises:
        IdentificationError: a topic is missing, or the samples do not serve.
    """
    raise NotImplementedError


def from_csv(path: Path, columns: Mapping[str, str] | None = None) -> Measurements:
    """A CSV file with columns for time, pose and wrench, and optionally for the velocities.

    The columns are time, x, y, heading or heading_deg; u, v, r where measured; surge_force, sway_force, yaw_moment, else zero.

    Args:
        path: The file; its first row has the names.
        columns: The file's name of each of these columns, where it differs.

    Raises:
        IdentificationError: a column is missing, or the samples do not serve.
    """
    raise NotImplementedError
