"""The campaign file: YAML with a base scenario, distributions, laws, number, seed and limits; docs/campaigns.md explains it."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.parameters_file import in_one_line
from vessel_hsmc_ros.scenario.ros_yaml import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import parse_scenario, scenario_text
from vessel_hsmc_ros.studies.campaign import sampling
from vessel_hsmc_ros.studies.campaign.distributions import Drawn, Grid, make_drawn
from vessel_hsmc_ros.studies.campaign.ship_expansion import resolved

LAW = "controller.law"

KEYS = ("scenario", "set", "laws", "variants", "runs", "sampling", "seed", "draw", "limits", "chunk")

CHUNK = 100

LENGTHS = "lengths"  # the unit of a limit that is relative to the length of the hull


class Source(NamedTuple):
    """The texts that define a campaign, from which any process can make it."""

    name: str  # name of the campaign: that of its file
    text: str  # content of the campaign file
    scenario_name: str  # name of the base scenario
    scenario: str  # its ROS parameters file


T = TypeVar("T", bound="CampaignFile")


@dataclass(frozen=True)
class CampaignFile:
    """The content of a campaign file, checked as far as is possible without its runs."""

    source: Source  # the texts that define it
    changes: Mapping[str, object]  # fixed changes to the scenario, by `node.parameter`
    variants: Mapping[str, Mapping[str, object]]  # the changes of each run of a draw, by the names of the variants
    repetitions: int  # number of draws, for each combination of the grids if there are any
    sampling: str  # one of `sampling.METHODS`
    seed: int  # of all random numbers
    parameters: tuple[Drawn, ...]  # the drawn parameters in the order of the file
    limits: Mapping[str, float]  # largest magnitudes of metrics: a run above any is a failure
    limits_in_lengths: Mapping[str, float]  # the same in lengths of the hull
    chunk: int  # number of runs in a file of the dataset

    @classmethod
    def parse(cls: type[T], source: Source, runs: int | None = None) -> T:
        """Make a campaign from its texts.

        `runs`: number of draws instead of the file's number. Raises ScenarioError if the file or the scenario is malformed;
        ParameterError if a parameter, distribution, limit or law is not allowed.
        """
        try:
            return cls(source, *_parse(source, document(source), runs))
        except ParameterError as error:
            raise ParameterError(f"campaign {source.name}: {error}") from None


def campaign_names() -> list[str]:
    """Names of the campaigns that come with the package."""
    return sorted(path.stem for path in (share_directory() / "config" / "campaigns").glob("*.yaml"))


def read_source(name: Path | str) -> Source:
    """Read the texts of a campaign.

    `name`: a campaign of the package, or the path of a YAML file; a scenario that it names by a path is looked up from the
    folder of that file. Raises ScenarioError if campaign or scenario are unknown or cannot be read, or the file has no
    scenario.
    """
    path = _find(name)
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"campaign file {path} cannot be read: {in_one_line(error)}") from None
    scenario = document(Source(path.stem, text, "", "")).get("scenario")
    if not isinstance(scenario, str):
        raise ScenarioError(f"campaign file {path}: scenario must be a name or the path of a YAML file (got {scenario})")
    located = path.parent / scenario if Path(scenario).suffix in (".yaml", ".yml") else scenario
    return Source(path.stem, text, Path(scenario).stem, scenario_text(located))


def document(source: Source) -> dict[str, Any]:
    """The entries of a campaign file. Raises ScenarioError if it is not YAML, or has other keys."""
    try:
        found = read_yaml(source.text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"campaign {source.name} cannot be read: {in_one_line(error)}") from None
    if not isinstance(found, dict) or "scenario" not in found:
        raise ScenarioError(f"campaign {source.name} is not a campaign file: its keys must be {', '.join(KEYS)}")
    for key in found:
        if key not in KEYS:
            raise ScenarioError(f"campaign {source.name}: {key} is not a key: {schema.suggestion(str(key), KEYS)}")
    return found


def with_seed(source: Source, seed: int) -> Source:
    """The texts of the same campaign with another seed, which is another campaign."""
    text, count = re.subn(r"(?m)^seed:.*$", f"seed: {seed}", source.text)
    return source._replace(text=text if count else f"{source.text.rstrip()}\nseed: {seed}\n")


def read_about(folder: Path) -> dict[str, Any]:
    """Read campaign.json in the folder of a campaign. Raises CampaignError if it is missing or damaged."""
    try:
        about = json.loads(read_text(folder / "campaign.json"))
        return {**about, "repetitions": int(about["repetitions"])}
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError):
        raise CampaignError(f"{folder} is not the folder of a campaign: it has no valid campaign.json") from None


def source_of_folder(folder: Path, runs: int | None = None) -> tuple[Source, int]:
    """Read the texts of the campaign of a folder, and the number of draws that were requested if no other is given.

    Raises CampaignError if the folder is not that of a campaign.
    """
    about = read_about(folder)
    try:
        text, scenario = read_text(folder / "campaign.yaml"), read_text(folder / "scenario.yaml")
        return Source(str(about["name"]), text, str(about["scenario"]), scenario), runs or about["repetitions"]
    except (OSError, UnicodeDecodeError, KeyError) as error:
        raise CampaignError(f"{folder} is not the folder of a campaign: {error}") from None


def _parse(source: Source, entries: Mapping[str, Any], runs: int | None) -> tuple[Any, ...]:
    """The entries in the order of the fields of `CampaignFile`."""
    changes = dict(_mapping(entries, "set"))
    text, name, place = source.scenario, source.scenario_name, f"scenario of {source.name}"
    variants = _variants(entries) or {"": {}}
    # Every variant is checked at its base values; those of a draw may still be unstable, which is a result.
    base, *_ = [parse_scenario(text, name, resolved(changes, variant), place) for variant in variants.values()]
    if "" in variants:
        variants = {base.controller.law: {LAW: base.controller.law}}
    if base.vessel_sim.duration <= 0.0:
        raise ParameterError("vessel_sim.duration must be above 0 s in a campaign (got 0 s, which has no end)")
    parameters = tuple(make_drawn(str(key), given, base) for key, given in _mapping(entries, "draw").items())
    has_grid = any(isinstance(parameter.distribution, Grid) for parameter in parameters)
    return (
        changes,
        variants,
        runs or _integer(entries, "runs", 1, sampling.MAX_RUNS, 1 if has_grid else None),
        _sampling(entries, has_grid),
        _integer(entries, "seed", 0, 2**63, 0),
        parameters,
        *_limits(_mapping(entries, "limits")),
        _integer(entries, "chunk", 1, 1_000_000, CHUNK),
    )


def _find(name: Path | str) -> Path:
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return path
    if str(name) not in campaign_names():
        known = ", ".join(campaign_names())
        raise ScenarioError(
            f"campaign {name} is unknown: it must be {f'one of {known} or ' if known else ''}the path of a YAML file"
        )
    return share_directory() / "config" / "campaigns" / f"{name}.yaml"


def _mapping(entries: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = entries.get(key)
    if found is not None and not isinstance(found, dict):
        raise ParameterError(f"{key} must be names with their values, such as {{name: value}} (got {found})")
    if not all(isinstance(name, str) for name in found or {}):
        raise ParameterError(f"every name of {key} must be a text (got {found})")
    return found or {}


def _integer(entries: Mapping[str, Any], key: str, low: int, high: int, default: int | None) -> int:
    value = entries.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ParameterError(f"{key} must be an integer from {low} to {high} (got {value})")
    return value


def _variants(entries: Mapping[str, Any]) -> dict[str, Mapping[str, object]]:
    """The variants by their names: those of the file, or one for each law; none if the file has neither."""
    variants = _mapping(entries, "variants")
    if not variants:
        return {law: {LAW: law} for law in _laws(entries.get("laws"))}
    if "laws" in entries:
        raise ParameterError(f"laws cannot be given with variants (got {entries['laws']}): give controller.law in each variant")
    for name, changes in variants.items():
        if (
            not isinstance(name, str)
            or not name
            or not isinstance(changes, dict)
            or not all(isinstance(key, str) for key in changes)
        ):
            raise ParameterError(f"variants: {name} must be a name with changes by node.parameter (got {changes})")
    return dict(variants)


def _laws(given: Any) -> tuple[str, ...]:
    if given is None:
        return ()
    laws = given if isinstance(given, list) else [given]
    for law in laws:
        if law not in LAWS:
            raise ParameterError(f"laws must be any of {', '.join(LAWS)} (got {law})")
    if not laws or len(set(laws)) < len(laws):
        raise ParameterError(f"laws must be different laws, at least one (got {laws})")
    return tuple(laws)


def _sampling(entries: Mapping[str, Any], has_grid: bool) -> str:
    method = entries.get("sampling", "random")
    if method not in sampling.METHODS:
        raise ParameterError(f"sampling must be one of {', '.join(sampling.METHODS)} (got {method})")
    if has_grid and method == "sobol":
        raise ParameterError(
            "sampling must be random or latin_hypercube with a grid, which cuts a Sobol sequence into pieces (got sobol)"
        )
    return str(method)


def _limits(given: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, float]]:
    """The limits as numbers, and those in lengths of the hull: `{lengths: 0.02}`."""
    found: tuple[dict[str, float], dict[str, float]] = {}, {}
    for name, entry in given.items():
        if name not in Metrics._fields:
            raise ParameterError(f"limits: {name} is not a metric: {schema.suggestion(str(name), Metrics._fields)}")
        in_lengths = isinstance(entry, dict) and list(entry) == [LENGTHS]
        limit = entry[LENGTHS] if in_lengths else entry
        if isinstance(limit, bool) or not isinstance(limit, int | float) or not (math.isfinite(limit) and limit >= 0.0):
            raise ParameterError(f"limits: {name} must be a finite number, not below 0, or {{{LENGTHS}: number}} (got {limit})")
        found[in_lengths][name] = float(limit)
    return found
