"""Opens the folder of a campaign for computing: one process at a time, and only for the campaign that it belongs to."""

import fcntl
import json
import logging
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version

from vessel_hsmc_ros.campaign.dataset import Dataset, write_file
from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.campaign.plan_file import read_about
from vessel_hsmc_ros.core.exceptions import CampaignError

LOCK, ABOUT = "campaign.lock", "campaign.json"

PACKAGES = ("vessel_hsmc_ros", "numba", "numpy", "pyarrow", "scipy")
"""What the last digits of a row and the bytes of a file may depend on."""


@contextmanager
def opened(dataset: Dataset, campaign: Campaign) -> Iterator[None]:
    """A context in which no other process computes chunks of the same folder; it is created if it does not exist.

    Raises:
        CampaignError: another process computes there, the folder is that of another campaign, or it cannot be written.
    """
    path = dataset.path
    if path.is_dir() and any(path.iterdir()) and not any((path / name).exists() for name in (LOCK, ABOUT)):
        raise CampaignError(f"{path} is not empty and not the folder of a campaign: choose another --output")
    try:
        dataset.rows.mkdir(parents=True, exist_ok=True)
        lock = (path / LOCK).open("ab")
    except OSError as error:
        raise CampaignError(f"folder {dataset.path} cannot be made: {error.strerror}") from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # released by the system, however the process ends
        except OSError:
            raise CampaignError(f"another process computes the campaign in {dataset.path}: wait until it ends") from None
        _prepare(dataset, campaign)
        for remainder in dataset.rows.glob(".chunk-*"):  # of a process that was killed
            remainder.unlink(missing_ok=True)
        yield


def versions() -> dict[str, str]:
    """Versions of what the rows are computed with."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "none"
    return found


def differences(found: Mapping[str, str], expected: Mapping[str, str]) -> str:
    """Versions that are not the expected ones, in one line; empty if there are none."""
    names = [name for name in expected if found.get(name) != expected[name]]
    return ", ".join(f"{name} {found.get(name, 'none')} instead of {expected[name]}" for name in names)


def _prepare(dataset: Dataset, campaign: Campaign) -> None:
    """Write the texts of a campaign into a new folder, or check that those of an older one are the same."""
    about = {
        "name": campaign.name,
        "scenario": campaign.source.scenario_name,
        "digest": campaign.digest,
        "repetitions": campaign.repetitions,
        "draws": campaign.draws,
        "runs": campaign.runs,
        "laws": list(campaign.laws),
        "chunk": campaign.chunk,
        "versions": versions(),
    }
    if (dataset.path / ABOUT).exists():
        before = read_about(dataset.path)
        if before.get("digest") != campaign.digest:
            raise CampaignError(f"{dataset.path} belongs to another campaign than {campaign.name}: choose another --output")
        if before["repetitions"] > campaign.repetitions:
            raise CampaignError(
                f"{dataset.path} has {before['repetitions']} draws already: give --runs with at least that number"
            )
        if changed := differences(versions(), before.get("versions", {})):
            logging.getLogger(__name__).warning("rows of %s may differ in their last digits: %s", dataset.path, changed)
            about["versions"] = before["versions"]
        if about == before:
            return
    write_file(dataset.path / "scenario.yaml", campaign.source.scenario.encode())
    write_file(dataset.path / "campaign.yaml", campaign.source.text.encode())
    # Last: with it the folder is complete.
    write_file(dataset.path / ABOUT, (json.dumps(about, indent=2) + "\n").encode())
