"""The folder of a campaign: the texts that define it, and its rows as Parquet files, each of one chunk of runs.

    campaign.yaml, scenario.yaml   complete copies of the campaign file and the base scenario
    campaign.json                  hash, number of draws, chunk size, versions of the code
    rows/chunk-00012.parquet       runs 1200 to 1299 of a campaign with chunks of 100
    sweep.csv                      all rows of a sweep, which needs no library of Parquet files

A file appears by an atomic rename, so it is complete at every instant; it contains no time, machine or path, so it is the same
wherever it was computed. It names its campaign by the hash. One process at a time computes into a folder, and only for its
campaign.
"""

import ast
import csv
import fcntl
import json
import logging
import math
import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.core.exceptions import CampaignError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.studies.campaign.plan import Campaign, read_about

if TYPE_CHECKING:
    import pyarrow


_DIGEST, _CHUNK = b"campaign", b"chunk"


class Dataset:
    """The folder of a campaign."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows = path / "rows"
        self.sweep = path / "sweep.csv"

    def chunk_path(self, number: int) -> Path:
        """The file of a chunk."""
        return self.rows / f"chunk-{number:05d}.parquet"

    def files(self) -> list[Path]:
        """The files of all chunks that exist, in their order."""
        return sorted(self.rows.glob("chunk-*.parquet"), key=_number)

    def missing(self, campaign: Campaign) -> Iterator[int]:
        """Numbers of the chunks that are not there, or have fewer rows than the campaign by now, in their order."""
        there = {_number(path): path for path in self.files()}
        for number in range(campaign.chunks):
            if number not in there or check_chunk(there[number], campaign) < len(campaign.runs_of(number)):
                yield number


def write_file(path: Path, content: bytes) -> None:
    """Write a file that exists either completely or not at all, also after a loss of power."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with new.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        new.replace(path)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise CampaignError(f"{path} cannot be written: {error.strerror}") from None


def column_types(campaign: Campaign) -> dict[str, Any]:
    """Types of the columns of the rows of a campaign, by their names."""
    return {
        **{"run": int, "draw": int, "law": str},
        **({"variant": str} if campaign.variant_column == "variant" else {}),
        "seed": int,
        **{parameter.name: parameter.type for parameter in campaign.parameters},
        **{"failed": bool, "failure": str, "ended_early": bool},
        **({"infeasible": str} if campaign.has_ships else {}),
        **dict.fromkeys(Metrics._fields, float),
    }


def table_schema(campaign: Campaign, chunk: int) -> "pyarrow.Schema":
    """Columns of the rows of a campaign, and the notes of the file of a chunk."""
    pa = _pyarrow()
    scalars = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
    types = scalars | {tuple[float, ...]: pa.list_(pa.float64()), tuple[str, ...]: pa.list_(pa.string())}
    notes = {_DIGEST: campaign.digest.encode(), _CHUNK: str(chunk).encode()}
    return pa.schema([(name, types[of]) for name, of in column_types(campaign).items()], metadata=notes)


def write_table(rows: list[dict[str, Any]], campaign: Campaign, chunk: int) -> bytes:
    """The Parquet file of a chunk: equal rows give equal bytes."""
    pa = _pyarrow()
    from pyarrow import parquet

    columns = table_schema(campaign, chunk)
    table = pa.Table.from_pylist(rows, schema=columns)
    sink = pa.BufferOutputStream()
    parquet.write_table(table, sink, compression="zstd", version="2.6", write_page_checksum=True)
    return sink.getvalue().to_pybytes()  # type: ignore[no-any-return]


def check_chunk(path: Path, campaign: Campaign) -> int:
    """Check that a file is a chunk of a campaign, by its first and last bytes."""
    pa = _pyarrow()
    from pyarrow import parquet

    try:
        found = parquet.read_metadata(path)
        columns = found.schema.to_arrow_schema()
    except (OSError, pa.ArrowException):
        raise CampaignError(f"{path} is cut or is not a Parquet file: remove it, and it is computed anew") from None
    number = _number(path)
    if not columns.equals(table_schema(campaign, number), check_metadata=True) or found.num_rows > len(campaign.runs_of(number)):
        raise CampaignError(f"{path} belongs to another campaign: remove it, or choose another --output")
    return int(found.num_rows)


def read_rows(folder: Path | str) -> "pyarrow.Table":
    """Read all rows that a campaign has so far.

    Args:
        folder: The folder of the campaign; one that is still being computed is allowed.

    Returns:
        A table with a row for each run, sorted by their numbers: `run`, `draw`, `law`, `seed`, the drawn parameters, `failed`,
        `failure`, `ended_early`, and the metrics; where a file has variants `variant`, and of ships of the family `infeasible`,
        why no law can keep the ship, empty if one can.

    Raises:
        CampaignError: the folder is not that of a campaign, or a file of it is cut or that of another campaign.
    """
    pa = _pyarrow()
    campaign, dataset = Campaign.of_folder(folder), Dataset(Path(folder))
    columns = table_schema(campaign, 0).remove_metadata()
    tables = [read_chunk(path, campaign) for path in dataset.files()]
    return pa.concat_tables(tables) if tables else pa.Table.from_pylist(read_sweep_rows(dataset, campaign), schema=columns)


def read_chunk(path: Path, campaign: Campaign) -> "pyarrow.Table":
    """Read the rows of a chunk. Raises CampaignError if the file is cut, damaged or that of another campaign."""
    pa = _pyarrow()
    from pyarrow import parquet

    check_chunk(path, campaign)
    try:
        return parquet.read_table(path, page_checksum_verification=True).replace_schema_metadata(None)
    except (OSError, pa.ArrowException):
        raise CampaignError(f"{path} is damaged: remove it, and `vessel-hsmc campaign` computes it anew") from None


def write_sweep_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write all rows of a sweep as a table."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, dict.fromkeys((*rows[0], *Metrics._fields)), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read_sweep_rows(dataset: Dataset, campaign: Campaign) -> list[dict[str, Any]]:
    """Read the rows of a sweep, bit-identical to those that were written; none of a campaign that is no sweep."""
    if not dataset.sweep.exists():
        return []
    types = column_types(campaign)
    try:
        with dataset.sweep.open(encoding="utf-8", newline="") as stream:
            return [{name: _value(row[name], of) for name, of in types.items()} for row in csv.DictReader(stream)]
    except (OSError, KeyError, SyntaxError, TypeError, ValueError):
        raise CampaignError(f"{dataset.sweep} is damaged or is that of another sweep: sweep again") from None


def _value(text: str, of: Any) -> Any:
    if of is str:
        return text
    if of is float:
        return float(text) if text else None
    return ast.literal_eval(text)


def _number(path: Path) -> int:
    """Number of the chunk of a file."""
    digits = path.stem.rpartition("-")[2]
    if not digits.isdecimal():
        raise CampaignError(f"{path} is not a file of a campaign: remove it")
    return int(digits)


def _pyarrow() -> Any:
    """The library of Parquet files, which only campaigns and exports need."""
    require("pyarrow")
    import pyarrow

    return pyarrow


@dataclass(frozen=True)
class Row:
    """A row of a campaign that was run."""

    campaign: Campaign
    run: int  # number of the row
    values: Mapping[str, Any]  # its columns by their names; empty if it is not computed yet

    @classmethod
    def read(cls, folder: Path | str, run: int) -> "Row":
        """Read a row."""
        campaign = Campaign.of_folder(folder)
        campaign.planned(run)  # checks the number
        dataset = Dataset(Path(folder))
        path = dataset.chunk_path(run // campaign.chunk)
        rows = read_chunk(path, campaign).to_pylist() if path.exists() else read_sweep_rows(dataset, campaign)
        return cls(campaign, run, next((row for row in rows if row["run"] == run), {}))

    def scenario(self, changes: Mapping[str, object] | None = None) -> Scenario:
        """The scenario of the row, in lockstep; with changes that do not affect its results, such as those of `for_nodes`."""
        return self.campaign.scenario(self.run, {**{f"{node}.lockstep": True for node in NODES}, **(changes or {})})

    def differences(self, metrics: Metrics | None, failure: str = "") -> list[str]:
        """Compare a run with the row.

        Returns a line for each difference; none if all metrics are bit-identical, or both ended early for the same reason.
        """
        if self.values["ended_early"]:
            expected = self.values["failure"]
            return [] if expected in failure else [f"the row ended early: {expected}; the run: {failure or 'complete'}"]
        if metrics is None:
            return [f"the row is complete; the run: {failure or 'without metrics'}"]
        found = metrics._asdict()
        return [
            f"{name} = {self.values[name]!r} in the row, {value!r} in the run"
            for name, value in found.items()
            if not _equal(self.values[name], value)
        ]


def _equal(a: float | None, b: float | None) -> bool:
    """Whether two metrics are the same number, both NaN or both None."""
    return a == b or (a is not None and b is not None and math.isnan(a) and math.isnan(b))


LOCK, ABOUT = "campaign.lock", "campaign.json"

PACKAGES = ("vessel_hsmc_ros", "numba", "numpy", "pyarrow", "scipy")
"""What the last digits of a row and the bytes of a file may depend on."""


@contextmanager
def opened(dataset: Dataset, campaign: Campaign) -> Iterator[None]:
    """A context in which no other process computes chunks of the same folder; it is created if it does not exist."""
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
