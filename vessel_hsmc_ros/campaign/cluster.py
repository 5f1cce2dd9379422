"""Computes chunks on a Dask cluster: this process submits them, and receives the content of their files.

Workers need this package in the same version, but neither the files of the campaign nor those of its laws: a task carries their
texts. A worker that is lost costs the chunks that it was computing, which the scheduler gives to another one.
"""

import logging
import platform
import re
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.campaign.chunks import campaign_of, run_chunk
from vessel_hsmc_ros.campaign.folder import differences, versions
from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.campaign.plan_file import Source
from vessel_hsmc_ros.core.exceptions import CampaignError, InstallationError, ParameterError, VesselHsmcError
from vessel_hsmc_ros.scenario.law_file import load_law_file, loaded_law_files
from vessel_hsmc_ros.scenario.parameters_file import in_one_line

CONNECT_LIMIT = 10.0
"""Time limit for the connection with the scheduler, s."""

AHEAD = 3
"""Chunks for each thread of the cluster that are submitted at a time, so that no worker waits for this process."""

_one_at_a_time = threading.Lock()


class Job(NamedTuple):
    """What a worker needs for any chunk: the texts of the campaign, and of the Python files with its laws, by their names."""

    source: Source
    repetitions: int
    law_files: tuple[tuple[str, bytes], ...]


class Computed(NamedTuple):
    """A chunk as a worker returns it: its number, the content of its file, and where and with what it was computed."""

    number: int
    content: bytes
    host: str
    versions: dict[str, str]


def check_address(scheduler: str) -> None:
    """Check the form of the address of a scheduler.

    Raises:
        ParameterError: it has another form.
    """
    if not re.fullmatch(r"(tcp|tls|ucx|wss?)://.+:\d{1,5}", scheduler):
        raise ParameterError(f"--scheduler {scheduler} is not allowed: it takes an address such as tcp://host:8786")


def compute(scheduler: str, campaign: Campaign, numbers: Sequence[int]) -> Iterator[tuple[int, bytes]]:
    """Compute chunks on a cluster.

    Args:
        scheduler: Address of the scheduler, such as tcp://host:8786.
        campaign: The campaign.
        numbers: The chunks.

    Yields:
        Number and file content of each chunk as soon as it is computed, in any order.

    Raises:
        CampaignError: the scheduler cannot be reached, the connection is lost, or a worker fails or has other versions.
    """
    law_files = tuple((path.name, path.read_bytes()) for path in loaded_law_files())
    job = Job(campaign.source, campaign.repetitions, law_files)
    expected = versions()
    with _connected(scheduler) as client:
        for done in _submitted(client, job, numbers):
            if different := differences(done.versions, expected):
                raise CampaignError(
                    f"the worker on {done.host} has {different}: its rows might differ, install the same versions"
                )
            yield done.number, done.content


def compute_chunk(job: Job, number: int) -> Computed:
    """Compute a chunk, in a worker."""
    # Chunks in threads of one process would share the buffers of the simulation; a worker with one thread loses nothing.
    with _one_at_a_time:
        for name, content in job.law_files:
            _load_law(name, content)
        content = run_chunk(campaign_of(job.source, job.repetitions), number)
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
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise InstallationError("--scheduler needs distributed, which is not installed: pip install distributed") from None
    try:
        client = Client(scheduler, timeout=CONNECT_LIMIT, set_as_default=False)
    except OSError:
        raise CampaignError(f"no Dask scheduler answers at {scheduler} within {CONNECT_LIMIT:g} s") from None
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_LIMIT)


def _submitted(client: Any, job: Job, numbers: Sequence[int]) -> Iterator[Computed]:
    """Submit chunks, a few ahead of those that are being computed, and yield them as they are done."""
    from distributed import as_completed

    if not client.nthreads():
        logging.getLogger(__name__).warning("the cluster has no workers yet: waiting for one")
    remaining = iter(numbers)
    futures = as_completed(loop=client.loop)

    def submit() -> None:
        """Keep every thread of the cluster busy, also those of workers that have joined it meanwhile."""
        lacking = AHEAD * max(sum(client.nthreads().values()), 1) - futures.count()
        for number in islice(remaining, max(lacking, 0)):
            futures.add(client.submit(compute_chunk, job, number, pure=False))

    submit()
    for future in futures:
        yield _result(future)
        future.release()
        submit()


def _result(future: Any) -> Computed:
    """The result of a chunk.

    Raises:
        CampaignError: it was not computed.
    """
    try:
        return Computed(*future.result())
    except VesselHsmcError:
        raise
    except Exception as error:  # whatever a worker raised, or the library about the cluster
        raise CampaignError(f"the cluster has not computed a chunk: {type(error).__name__}: {in_one_line(error)}") from None
