"""A campaign: one YAML file with a scenario, distributions over its parameters, and the runs that they define.

Run i is a pure function of the campaign file, the scenario and i, its noise included. A draw gives all drawn parameters a
value; its runs, one for each variant, share these values and the noise, so that variants are compared on the same ships and
seas. A variant is a named set of changes; those of a file with `laws` change the law alone and have its name.

    run = draw · (number of variants) + index of the variant
"""

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.law_file import law_provenance
from vessel_hsmc_ros.scenario.named_files import CAMPAIGNS, SUFFIXES
from vessel_hsmc_ros.scenario.parameters_file import parsed, read_text
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario, scenario_text
from vessel_hsmc_ros.scenario.warnings import check_effects
from vessel_hsmc_ros.studies.campaign.distributions import (
    METHODS,
    SHIP,
    Drawn,
    Grid,
    make_drawn,
    noise_seed,
    parse_axis,
    point,
    ship_family,
)

LAW = "controller.law"

KEYS = ("scenario", "set", "laws", "variants", "runs", "sampling", "seed", "draw", "limits", "metrics", "chunk")

CHUNK = 100

LENGTHS = "lengths"  # the unit of a limit that is relative to the length of the hull


class Source(NamedTuple):
    """The texts that define a campaign, from which any process can make it."""

    name: str  # name of the campaign: that of its file
    text: str  # content of the campaign file
    scenario_name: str  # name of the base scenario
    scenario: str  # its ROS parameters file


def read_source(name: Path | str) -> Source:
    """Read the texts of a campaign."""
    path = CAMPAIGNS.find(name)
    text = CAMPAIGNS.read(path)
    scenario = document(Source(path.stem, text, "", "")).get("scenario")
    if not isinstance(scenario, str):
        raise ScenarioError(f"campaign file {path}: scenario must be a name or the path of a YAML file (got {scenario})")
    located = path.parent / scenario if Path(scenario).suffix in SUFFIXES else scenario
    return Source(path.stem, text, Path(scenario).stem, scenario_text(located))


def document(source: Source) -> dict[str, Any]:
    """The entries of a campaign file. Raises ScenarioError if it is not YAML, or has other keys."""
    found = parsed(source.text, f"campaign {source.name}")
    if not isinstance(found, dict) or "scenario" not in found:
        raise ScenarioError(f"campaign {source.name} is not a campaign file: its keys must be {', '.join(KEYS)}")
    for key in found:
        if key not in KEYS:
            raise ScenarioError(f"campaign {source.name}: {key} is not a key: {schema.suggestion(str(key), KEYS)}")
    return found


def read_about(folder: Path) -> dict[str, Any]:
    """Read campaign.json in the folder of a campaign. Raises CampaignError if it is missing or damaged."""
    try:
        about = json.loads(read_text(folder / "campaign.json"))
        return {**about, "repetitions": int(about["repetitions"])}
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError):
        raise CampaignError(f"{folder} is not the folder of a campaign: it has no valid campaign.json") from None


def source_of_folder(folder: Path, runs: int | None = None) -> tuple[Source, int]:
    """Read the texts of the campaign of a folder, and the number of draws that were requested if no other is given."""
    about = read_about(folder)
    try:
        text, scenario = read_text(folder / "campaign.yaml"), read_text(folder / "scenario.yaml")
        return Source(str(about["name"]), text, str(about["scenario"]), scenario), runs or about["repetitions"]
    except (OSError, UnicodeDecodeError, KeyError) as error:
        raise CampaignError(f"{folder} is not the folder of a campaign: {error}") from None


def resolved(*layers: Mapping[str, object]) -> dict[str, Any]:
    """Layers of changes in one, the later ones over the earlier ones, with the numbers of a ship of a family expanded."""
    merged = {name: value for layer in layers for name, value in layer.items()}
    numbers = {name.removeprefix(SHIP): merged.pop(name) for name in list(merged) if name.startswith(SHIP)}
    # What is changed by name stays so, whatever the expansion contains.
    return {**schema.build(ship_family(), numbers, "ship").changes(), **merged} if numbers else merged


def _parse(source: Source, entries: Mapping[str, Any], runs: int | None) -> tuple[Any, ...]:
    """The entries in the order of the fields of `Campaign`."""
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
        runs or _integer(entries, "runs", 1, 2**30, 1 if has_grid else None),
        _sampling(entries, has_grid),
        _integer(entries, "seed", 0, 2**63, 0),
        parameters,
        *_limits(_mapping(entries, "limits")),
        _metrics(entries.get("metrics", [])),
        _integer(entries, "chunk", 1, 1_000_000, CHUNK),
    )


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
    if method not in METHODS:
        raise ParameterError(f"sampling must be one of {', '.join(METHODS)} (got {method})")
    if has_grid and method == "sobol":
        raise ParameterError(
            "sampling must be random or latin_hypercube with a grid, which cuts a Sobol sequence into pieces (got sobol)"
        )
    return str(method)


def _limits(given: Mapping[str, Any]) -> tuple[dict[str, float], frozenset[str]]:
    """The limits as numbers, and the names of those in lengths of the hull, `{lengths: 0.02}`, which are last."""
    absolute: dict[str, float] = {}
    relative: dict[str, float] = {}
    for name, entry in given.items():
        if name not in Metrics._fields:
            raise ParameterError(f"limits: {name} is not a metric: {schema.suggestion(str(name), Metrics._fields)}")
        in_lengths = isinstance(entry, dict) and list(entry) == [LENGTHS]
        limit = entry[LENGTHS] if in_lengths else entry
        if isinstance(limit, bool) or not isinstance(limit, int | float) or not (math.isfinite(limit) and limit >= 0.0):
            raise ParameterError(f"limits: {name} must be a finite number, not below 0, or {{{LENGTHS}: number}} (got {limit})")
        (relative if in_lengths else absolute)[name] = float(limit)
    return absolute | relative, frozenset(relative)


def _metrics(given: Any) -> tuple[str, ...]:
    for name in given if isinstance(given, list) else [given]:
        if name not in Metrics._fields:
            raise ParameterError(f"metrics must be any of {', '.join(Metrics._fields)} (got {name})")
    return tuple(dict.fromkeys(given))


SEED = "vessel_sim.seed"


class PlannedRun(NamedTuple):
    """What defines a run: its number, draw, law, the seed of its noise, the drawn values by their names, and its variant."""

    run: int
    draw: int
    law: str
    seed: int
    values: Mapping[str, Any]
    variant: str


@dataclass(frozen=True)
class Campaign:
    """A plan of runs with drawn parameters. `Campaign.load` makes one from a file, or from the folder of a campaign.

    campaign = Campaign.load("hull_uncertainty.yaml")
    run = simulate(campaign.scenario(48213))
    """

    source: Source  # the texts that define it
    changes: Mapping[str, object]  # fixed changes to the scenario, by `node.parameter`
    variants: Mapping[str, Mapping[str, object]]  # the changes of each run of a draw, by the names of the variants
    repetitions: int  # number of draws, for each combination of the grids if there are any
    sampling: str  # one of `METHODS`
    seed: int  # of all random numbers
    parameters: tuple[Drawn, ...]  # the drawn parameters in the order of the file
    limits: Mapping[str, float]  # largest magnitudes of metrics: a run above any is a failure
    in_lengths: frozenset[str]  # names of the metrics whose limits are in lengths of the hull
    metrics: tuple[str, ...]  # the metrics that its report shows, the main one first; none for its own choice
    chunk: int  # number of runs in a file of the dataset

    @classmethod
    def parse(cls, source: Source, runs: int | None = None) -> "Campaign":
        """Make a campaign from its texts."""
        try:
            return cls(source, *_parse(source, document(source), runs))
        except ParameterError as error:
            raise ParameterError(f"campaign {source.name}: {error}") from None

    @classmethod
    def load(cls, path: Path | str, runs: int | None = None, seed: int | None = None) -> "Campaign":
        """Read and check a campaign.

        `path`: a campaign of the package, such as `far_starts`; a YAML file; or the folder of a campaign that was run. `runs`:
        number of draws instead of the file's number. `seed`: seed instead of the file's seed; not of a folder, whose
        rows have theirs.

        Raises:
            ScenarioError: the file is unknown, unreadable or malformed.
            ParameterError: a parameter, distribution, limit or law of it is not allowed.
            CampaignError: the folder is not that of a campaign.
        """
        if Path(path).is_dir():
            if seed is not None:
                raise ParameterError(
                    f"seed cannot be given for the folder {path} (got {seed}): the rows in it have a seed already"
                )
            return cls.of_folder(path, runs)
        source = read_source(path)
        if seed is not None:  # another campaign, whose texts say so
            text, count = re.subn(r"(?m)^seed:.*$", f"seed: {seed}", source.text)
            source = source._replace(text=text if count else f"{source.text.rstrip()}\nseed: {seed}\n")
        return cls.parse(source, runs)

    @classmethod
    def of_folder(cls, folder: Path | str, runs: int | None = None) -> "Campaign":
        """Read the campaign of a folder; see `load`."""
        return cls.parse(*source_of_folder(Path(folder), runs))

    @property
    def name(self) -> str:
        """Name of the campaign: that of its file."""
        return self.source.name

    @cached_property
    def laws(self) -> tuple[str, ...]:
        """The law of each variant."""
        return tuple(base.controller.law for base in self.bases.values())

    @property
    def variant_column(self) -> str:
        """The column of the dataset that names the variant of a run."""
        return "law" if all(changes == {LAW: name} for name, changes in self.variants.items()) else "variant"

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the drawn parameters, which are columns of the dataset."""
        return tuple(parameter.name for parameter in self.parameters)

    @cached_property
    def draws(self) -> int:
        """Number of draws."""
        return self.repetitions * math.prod(len(values) for values in self.grids.values())

    @property
    def runs(self) -> int:
        """Number of runs, which is that of the rows of the complete dataset."""
        return self.draws * len(self.variants)

    @property
    def chunks(self) -> int:
        """Number of files of the complete dataset."""
        return -(-self.runs // self.chunk)

    @property
    def notes(self) -> list[str]:
        """What a user may want to know before the campaign runs, one line each."""
        below = 2 ** (self.draws.bit_length() - 1)
        found = sorted(self._without_effect())
        if self.sampling == "sobol" and below != self.draws:
            found.append(
                f"a Sobol sequence covers best with a power of two: {below} or {2 * below} draws instead of {self.draws}"
            )
        return found

    def _without_effect(self) -> set[str]:
        """That drawn parameters have no effect in any variant, as those of a law that it does not run; judged by some draws."""
        names = {parameter.parameter for parameter in self.parameters}
        found = []
        for run in {*range(len(self.variants)), *range(self.runs // 2, self.runs // 2 + len(self.variants)), self.runs - 1}:
            with suppress(ParameterError, ScenarioError):  # values that do not fit each other are a result of the run
                found.append({*check_effects(self.scenario(run), names, given=())})
        return set.intersection(*found) if found else set()

    @cached_property
    def grids(self) -> dict[str, tuple[Any, ...]]:
        """Values of the parameters that are on a grid, by their names."""
        return {
            parameter.name: parameter.distribution.values
            for parameter in self.parameters
            if isinstance(parameter.distribution, Grid)
        }

    @property
    def independent(self) -> bool:
        """Whether its draws are independent of each other, which confidence intervals assume."""
        return self.sampling == "random" and not self.grids

    @cached_property
    def digest(self) -> str:
        """Hash of everything that the rows depend on: equal for campaigns of which one extends the other."""
        content = {key: value for key, value in document(self.source).items() if key != "runs"}
        # The rows of a Latin hypercube depend on their number; those of other methods do not.
        runs = self.repetitions if self.sampling == "latin_hypercube" else None
        own_laws = {law: law_provenance(law).get("law_sha256") for law in self.laws}
        return hashlib.sha256(json.dumps([content, runs, own_laws, self.source.scenario]).encode()).hexdigest()

    def runs_of(self, chunk: int) -> range:
        """Numbers of the runs in a file of the dataset."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.runs))

    def planned(self, run: int) -> PlannedRun:
        """Draw, law, seed and drawn values of a run.

        Raises:
            ParameterError: the campaign has no run of that number.
        """
        if not 0 <= run < self.runs:
            raise ParameterError(f"run must be 0 to {self.runs - 1} in the campaign {self.name} (got {run})")
        draw, variant = divmod(run, len(self.variants))
        values = self.values(draw)
        seed = {SEED: noise_seed(self.seed, draw), **self.changes, **values}[SEED]
        return PlannedRun(run, draw, self.laws[variant], int(seed), values, list(self.variants)[variant])

    def values(self, draw: int) -> dict[str, Any]:
        """Values of the drawn parameters in a draw, by their names."""
        free = len(self.parameters) - len(self.grids)
        coordinates = iter(point(self.sampling, free, self.seed, self.draws, draw) if free else ())
        chosen = self._of_grids(draw)
        values: dict[str, Any] = {}
        for parameter in self.parameters:
            distribution = parameter.distribution
            drawn = chosen[parameter.name] if isinstance(distribution, Grid) else distribution.quantile(next(coordinates))
            values[parameter.name] = parameter.value(drawn)
        return values

    def limits_of(self, scenario: Scenario) -> dict[str, float]:
        """The limits of a run in SI units."""
        length = scenario.vessel_sim.vessel.length
        return {name: limit * length if name in self.in_lengths else limit for name, limit in self.limits.items()}

    def scenario(self, run: int, changes: Mapping[str, object] | None = None) -> Scenario:
        """The scenario of a run.

        `changes`: further changes by `node.parameter` that do not affect the results, such as those of `for_nodes`.

        Raises:
            ParameterError: the campaign has no such run, or its drawn values do not fit each other.
            ScenarioError: the rates do not fit each other.
        """
        planned = self.planned(run)
        layers = self._with_lists(planned.values), self.variants[planned.variant]
        own = resolved(self.changes, *layers) if self.has_ships else resolved(*layers)
        return self.bases[planned.variant].changed({**own, SEED: planned.seed, **(changes or {})})

    @property
    def base(self) -> Scenario:
        """The scenario with its fixed changes and those of the first variant."""
        return next(iter(self.bases.values()))

    @cached_property
    def bases(self) -> dict[str, Scenario]:
        """The scenario with its fixed changes and those of each variant."""
        text, name, place = self.source.scenario, self.source.scenario_name, f"scenario of {self.name}"
        changes = {variant: resolved(self.changes, own) for variant, own in self.variants.items()}
        return {variant: parse_scenario(text, name, each, place) for variant, each in changes.items()}

    @cached_property
    def has_ships(self) -> bool:
        """Whether its ships are those of the installed family."""
        return any(name.startswith(SHIP) for names in (self.drawn, self.changes, *self.variants.values()) for name in names)

    def _of_grids(self, draw: int) -> dict[str, Any]:
        """The combination of the grids' values in a draw; the last grid changes fastest."""
        shape = tuple(map(len, self.grids.values()))
        places = np.unravel_index(draw % math.prod(shape), shape)
        return {name: values[int(place)] for (name, values), place in zip(self.grids.items(), places, strict=True)}

    def _with_lists(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Changes by `node.parameter`, with drawn elements put into their lists."""
        changes: dict[str, Any] = {}
        for parameter in self.parameters:
            value, name = values[parameter.name], parameter.parameter
            if parameter.element is not None:
                node, _, rest = name.partition(".")
                base: Any = schema.flatten(getattr(self.base, node))[rest]
                elements = list(changes.get(name, base))
                elements[parameter.element] = value
                value = elements
            changes[name] = value
        return changes


def sweep_of(
    scenario: str,
    axes: Sequence[str],
    changes: Mapping[str, object] | None = None,
    laws: Sequence[str] = (),
    metrics: Sequence[str] = (),
) -> Campaign:
    """Make a campaign of one scenario on a grid of one or two parameters, all runs with the noise of the scenario.

    `axes`: the parameters with their values, such as `controller.rate_hz=20,50`, in the forms of `parse_axis`.
    """
    draw = dict(map(parse_axis, axes))
    if not 1 <= len(draw) == len(axes) <= 2:
        raise ParameterError(f"sweep must have one or two different parameters (got {' and '.join(axes) or 'nothing'})")
    name, given = Path(scenario).stem, dict(changes or {})
    entries = {
        "scenario": name,
        "set": {**given, SEED: load_scenario(scenario, given).vessel_sim.seed},
        **({"laws": [*laws]} if laws else {}),
        "draw": draw,
        "metrics": [*metrics],
    }
    return Campaign.parse(Source(f"{name}_sweep", yaml.safe_dump(entries, sort_keys=False), name, scenario_text(scenario)))
