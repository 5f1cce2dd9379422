"""Runs a campaign: computes the chunks that its folder lacks, by processes of this machine or by a Dask cluster.

A chunk is simulated, evaluated and written as one Parquet file, with the same bytes everywhere.

Workers of a cluster need this package in the same version, but neither the files of the campaign nor those of its laws: a task
carries their texts. A worker that is lost costs the chunks that it was computing, which the scheduler gives to another one.
"""

import logging
import platform
import re
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.law_file import load_law_file, loaded_law_files
from vessel_hsmc_ros.scenario.parameters_file import in_one_line
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.batch import Outcome, simulate_many
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, differences, opened, versions, write_file, write_table
from vessel_hsmc_ros.studies.campaign.distributions import ship_family
from vessel_hsmc_ros.studies.campaign.plan import Campaign, Source


@lru_cache(maxsize=4)
def campaign_of(source: Source, repetitions: int) -> Campaign:
    """The campaign of its texts; a process that computes many of its chunks makes it once."""
    return Campaign.parse(source, repetitions)


def run_chunk(campaign: Campaign, number: int, progress: Callable[[float], None] | None = None) -> bytes:
    """Compute the file of a chunk of a campaign in this process."""
    return write_table(compute_rows(campaign, campaign.runs_of(number), progress=progress), campaign, number)


def compute_rows(
    campaign: Campaign, runs: Sequence[int], workers: int | None = 1, progress: Callable[[float], None] | None = None
) -> list[dict[str, Any]]:
    """Compute rows of a campaign, so many at a time; None for one per core.

    A run whose drawn values do not fit each other, which is unstable or which fails is a row, not an error.
    """
    made = {run: _scenario(campaign, run) for run in runs}
    valid = [(run, scenario) for run, scenario in made.items() if isinstance(scenario, Scenario)]
    outcomes: dict[int, Outcome] = {}

    def on_result(outcome: Outcome) -> None:
        outcomes[valid[outcome.index][0]] = outcome
        if progress is not None:
            progress(len(outcomes) / len(runs))

    if workers != 1:
        ensure_compiled([scenario for _, scenario in valid])
    simulate_many([scenario for _, scenario in valid], workers=workers, on_result=on_result)
    refused = {run: Outcome(0, error) for run, error in made.items() if isinstance(error, str)}
    every = outcomes | refused
    limits = {run: campaign.limits_of(scenario) for run, scenario in valid}
    rows = [_row(campaign, run, every[run], limits.get(run, {})) for run in runs]
    if campaign.has_ships:
        first = {campaign.planned(run).draw: scenario for run, scenario in reversed(valid)}  # its variants share the ship
        reasons = {draw: ship_family().infeasible(scenario) for draw, scenario in first.items()}
        rows = [{**row, "infeasible": reasons.get(row["draw"], "")} for row in rows]
    return rows


def exceeded(metrics: Metrics, limits: Mapping[str, float]) -> str:
    """The limits that a run exceeds, in one line; empty if there are none.

    `metrics`: of the run; one that it does not have, such as the settling time of an error that did not settle, is above every
    limit, and so is NaN. `limits`: largest magnitudes by the names of metrics.
    """
    found = []
    for name, limit in limits.items():
        value = getattr(metrics, name)
        if value is None or not abs(value) <= limit:
            found.append(f"{name} = {'none' if value is None else f'{value:.6g}'} above {limit:g}")
    return "; ".join(found)


def _scenario(campaign: Campaign, run: int) -> Scenario | str:
    """The scenario of a run, or why its drawn values are not allowed."""
    try:
        return campaign.scenario(run)
    except (ParameterError, ScenarioError) as error:
        return str(error)


def _row(campaign: Campaign, run: int, outcome: Outcome, limits: Mapping[str, float]) -> dict[str, Any]:
    """The row of a run with its limits, by the names of the columns."""
    planned = campaign.planned(run)
    metrics = outcome.metrics
    failure = outcome.failure or (exceeded(metrics, limits) if metrics else "the run has no metrics")
    return {
        "run": run,
        "draw": planned.draw,
        "law": planned.law,
        campaign.variant_column: planned.variant,
        "seed": planned.seed,
        **planned.values,
        "failed": bool(failure),
        "failure": failure,
        "ended_early": bool(outcome.failure),
        **(metrics._asdict() if metrics else {}),
    }


OBSERVER = "controller.observer.enabled"

Progress = Callable[[float, int], None]


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
        runs: Number of draws instead of the file's number. A larger one extends a campaign that is not a Latin hypercube.
        seed: Seed instead of the file's seed, which makes it another campaign.
        on_progress: Called several times a second with the number of runs done and their total number.

    Returns:
        The folder.

    Raises:
        ScenarioError: the file or its scenario is unknown, unreadable or malformed.
        ParameterError: a parameter, distribution, limit or law of it, or the address of the scheduler is not allowed.
        CampaignError: the folder is in use, damaged or that of another campaign; or the cluster cannot be reached or fails.
        RunError: a worker process was killed.
    """
    if scheduler and not re.fullmatch(r"(tcp|tls|ucx|wss?)://.+:\d{1,5}", scheduler):
        raise ParameterError(f"--scheduler must be an address such as tcp://host:8786 (got {scheduler})")
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
            # They are written here: the workers need no common file system.
            for done, (number, content) in enumerate(compute(scheduler, campaign, missing), 1):
                write_file(dataset.chunk_path(number), content)
                report(done)
        elif missing:
            ensure_compiled(_samples(campaign))
            compute_one = partial(_compute, campaign.source, campaign.repetitions, dataset)
            batch.run_all(compute_one, missing, workers=workers, on_progress=report)
        report(len(missing))
    return dataset.path


def default_folder(campaign: Campaign) -> Path:
    """The folder of a campaign for which none was given."""
    return Path("runs") / f"{campaign.name}_campaign"


def _samples(campaign: Campaign) -> list[Scenario]:
    """A scenario of every program that the runs need: of each variant, with the observer and without."""
    both, bases = campaign.has_ships or OBSERVER in campaign.drawn, campaign.bases.values()
    return [
        base.changed({OBSERVER: enabled})
        for base in bases
        for enabled in ((False, True) if both else (base.controller.observer.enabled,))
    ]


def _compute(source: Source, repetitions: int, dataset: Dataset, number: int, progress: Callable[[float], None]) -> None:
    """Compute a chunk and write its file, in a process of this machine."""
    write_file(dataset.chunk_path(number), run_chunk(campaign_of(source, repetitions), number, progress))
    progress(1.0)


CONNECT_LIMIT = 10.0  # time limit for the connection with the scheduler, s
_one_at_a_time = threading.Lock()


class Computed(NamedTuple):
    """A chunk as a worker returns it: its number, the content of its file, and where and with what it was computed."""

    number: int
    content: bytes
    host: str
    versions: dict[str, str]


def compute(scheduler: str, campaign: Campaign, numbers: Sequence[int]) -> Iterator[tuple[int, bytes]]:
    """Compute chunks on a cluster: number and file content of each chunk as soon as it is computed, in any order."""
    law_files = [(path.name, path.read_bytes()) for path in loaded_law_files()]
    compute_one = partial(compute_chunk, campaign.source, campaign.repetitions, law_files)
    expected = versions()
    with _connected(scheduler) as client:
        for done in _submitted(client, compute_one, numbers):
            if different := differences(done.versions, expected):
                raise CampaignError(
                    f"the worker on {done.host} has {different}: its rows might differ, install the same versions"
                )
            yield done.number, done.content


def compute_chunk(source: Source, repetitions: int, law_files: Sequence[tuple[str, bytes]], number: int) -> Computed:
    """Compute a chunk, in a worker. `law_files`: names and contents of the Python files with the laws of the campaign."""
    # Chunks in threads of one process would share the buffers of the simulation; a worker with one thread loses nothing.
    with _one_at_a_time:
        for name, content in law_files:
            _load_law(name, content)
        content = run_chunk(campaign_of(source, repetitions), number)
    return Computed(number, content, platform.node(), versions())


@lru_cache(maxsize=32)
def _load_law(name: str, content: bytes) -> None:
    """Register the laws of a Python file from its content, once in each worker."""
    path = Path(tempfile.mkdtemp()) / name
    path.write_bytes(content)
    load_law_file(path)


@contextmanager
def _connected(scheduler: str) -> Iterator[Any]:
    """A connection with a scheduler; its errors are those of this package."""
    require("distributed")
    from distributed import Client

    try:
        client = Client(scheduler, timeout=CONNECT_LIMIT, set_as_default=False)
    except OSError:
        raise CampaignError(f"no Dask scheduler answers at {scheduler} within {CONNECT_LIMIT:g} s") from None
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_LIMIT)


def _submitted(client: Any, compute_one: Callable[[int], Computed], numbers: Sequence[int]) -> Iterator[Computed]:
    """Submit chunks, and yield them as they are done."""
    from distributed import as_completed

    if not client.nthreads():
        logging.getLogger(__name__).warning("the cluster has no workers yet: waiting for one")
    for future in as_completed(client.map(compute_one, numbers, pure=False), loop=client.loop):
        yield _result(future)
        future.release()


def _result(future: Any) -> Computed:
    """The result of a chunk."""
    try:
        return Computed(*future.result())
    except VesselHsmcError:
        raise
    except Exception as error:  # whatever a worker raised, or the library about the cluster
        raise CampaignError(f"the cluster has not computed a chunk: {type(error).__name__}: {in_one_line(error)}") from None
