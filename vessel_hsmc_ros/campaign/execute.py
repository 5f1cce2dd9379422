"""Runs a campaign: computes the chunks that its folder lacks, by processes of this machine or by a Dask cluster."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from vessel_hsmc_ros.campaign import cluster
from vessel_hsmc_ros.campaign.chunks import campaign_of, run_chunk
from vessel_hsmc_ros.campaign.dataset import Dataset, write_file
from vessel_hsmc_ros.campaign.folder import opened
from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.campaign.plan_file import Source
from vessel_hsmc_ros.runs import worker_pool
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compile import ensure_compiled

OBSERVER = "controller.observer.enabled"

Progress = Callable[[float, int], None]


class _Task(NamedTuple):
    """A chunk that a process of this machine computes and writes."""

    source: Source
    repetitions: int
    number: int
    folder: Path


def run_campaign(
    file: Path | str,
    folder: Path | str | None = None,
    *,
    workers: int | None = None,
    scheduler: str = "",
    runs: int | None = None,
    seed: int | None = None,
    on_progress: Progress | None = None,
) -> Path:
    """Compute the rows of a campaign that its folder does not have yet; `read_rows` reads them.

        folder = run_campaign("hull_uncertainty.yaml", workers=2)
        rows = read_rows(folder).to_pandas()

    The same call goes on after an interrupt or a crash: whatever file is complete stays, the others are computed. The files are
    the same bytes whoever computes them.

    Args:
        file: A campaign of the package, a YAML file, or the folder of a campaign, which it goes on with.
        folder: The folder of the results; `runs/<name>_campaign` by default.
        workers: Number of processes; None for one per core.
        scheduler: Address of a Dask scheduler, such as tcp://host:8786, whose workers then compute the chunks.
        runs: Number of draws in the place of that of the file. A larger one extends a campaign that is not a Latin hypercube.
        seed: Seed in the place of that of the file, which makes it another campaign.
        on_progress: Called several times a second with the number of runs done and their total number.

    Returns:
        The folder.

    Raises:
        ScenarioError: the file or its scenario is unknown, unreadable or malformed.
        ParameterError: a parameter, distribution, limit or law of it, or the address of the scheduler is not allowed.
        CampaignError: the folder is in use, damaged or that of another campaign; or the cluster cannot be reached or fails.
        RunError: a worker process was killed.
    """
    if scheduler:
        cluster.check_address(scheduler)
    campaign = Campaign.load(file, runs, seed)
    given = Path(file) if folder is None and Path(file).is_dir() else folder
    dataset = Dataset(Path(given or default_folder(campaign)))
    with opened(dataset, campaign):
        missing = list(dataset.missing(campaign))
        before = campaign.runs - sum(len(campaign.runs_of(number)) for number in missing)

        def report(chunks: float) -> None:
            if on_progress is not None:
                on_progress(min(before + chunks * campaign.chunk, campaign.runs), campaign.runs)

        report(0.0)
        if missing and scheduler:
            _compute_on_cluster(scheduler, campaign, dataset, missing, report)
        elif missing:
            tasks = [_Task(campaign.source, campaign.repetitions, number, dataset.path) for number in missing]
            ensure_compiled(_samples(campaign))
            worker_pool.run_all(_compute, tasks, workers=workers, on_progress=report)
        report(len(missing))
    return dataset.path


def default_folder(campaign: Campaign) -> Path:
    """The folder of a campaign for which none was given."""
    return Path("runs") / f"{campaign.name}_campaign"


def _samples(campaign: Campaign) -> list[Scenario]:
    """A scenario of every program that the runs need: of each variant, with the observer and without."""
    bases = campaign.bases.values()
    return [base.changed({OBSERVER: enabled}) for base in bases for enabled in _observers(campaign, base)]


def _observers(campaign: Campaign, base: Scenario) -> tuple[bool, ...]:
    return (False, True) if campaign.has_ships or OBSERVER in campaign.drawn else (base.controller.observer.enabled,)


def _compute(task: _Task, progress: Callable[[float], None]) -> None:
    """Compute a chunk and write its file, in a process of this machine."""
    campaign = campaign_of(task.source, task.repetitions)
    write_file(Dataset(task.folder).chunk_path(task.number), run_chunk(campaign, task.number, progress))
    progress(1.0)


def _compute_on_cluster(
    scheduler: str, campaign: Campaign, dataset: Dataset, missing: Sequence[int], report: Callable[[float], None]
) -> None:
    """Let a cluster compute chunks, and write their files here: the workers need no common file system."""
    for done, (number, content) in enumerate(cluster.compute(scheduler, campaign, missing), 1):
        write_file(dataset.chunk_path(number), content)
        report(done)
