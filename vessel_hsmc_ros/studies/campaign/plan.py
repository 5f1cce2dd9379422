"""A campaign: one scenario, distributions over its parameters, and the runs that they define.

Run i is a pure function of the campaign file, the scenario and i, its noise included. A draw gives all drawn parameters a
value; its runs, one for each variant, share these values and the noise, so that variants are compared on the same ships and
seas. A variant is a named set of changes; those of a file with `laws` change the law alone and have its name.

    run = draw · (number of variants) + index of the variant
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.law_file import law_provenance
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.studies.campaign import sampling
from vessel_hsmc_ros.studies.campaign.distributions import Grid
from vessel_hsmc_ros.studies.campaign.plan_file import LAW, CampaignFile, document, read_source, source_of_folder, with_seed
from vessel_hsmc_ros.studies.campaign.ship_expansion import resolved
from vessel_hsmc_ros.studies.campaign.ship_family import SHIP

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
class Campaign(CampaignFile):
    """A plan of runs with drawn parameters. `Campaign.load` makes one from a file, or from the folder of a campaign.

    campaign = Campaign.load("hull_uncertainty.yaml")
    run = simulate(campaign.scenario(48213))
    """

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
        return cls.parse(source if seed is None else with_seed(source, seed), runs)

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
        if self.sampling != "sobol" or below == self.draws:
            return []
        return [f"a Sobol sequence covers best with a power of two: {below} or {2 * below} draws instead of {self.draws}"]

    @cached_property
    def grids(self) -> dict[str, tuple[float, ...]]:
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
        seed = {SEED: sampling.noise_seed(self.seed, draw), **self.changes, **values}[SEED]
        return PlannedRun(run, draw, self.laws[variant], int(seed), values, list(self.variants)[variant])

    def values(self, draw: int) -> dict[str, Any]:
        """Values of the drawn parameters in a draw, by their names."""
        free = len(self.parameters) - len(self.grids)
        point = iter(sampling.point(self.sampling, free, self.seed, self.draws, draw) if free else ())
        chosen = self._of_grids(draw)
        values: dict[str, Any] = {}
        for parameter in self.parameters:
            distribution = parameter.distribution
            drawn = chosen[parameter.name] if isinstance(distribution, Grid) else distribution.quantile(next(point))
            values[parameter.name] = parameter.value(drawn)
        return values

    def limits_of(self, scenario: Scenario) -> dict[str, float]:
        """All limits of a run, those in lengths as numbers."""
        length = scenario.vessel_sim.vessel.length
        return {**self.limits, **{name: limit * length for name, limit in self.limits_in_lengths.items()}}

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
        """Whether its ships are those of the family of `ship_family`."""
        return any(name.startswith(SHIP) for names in (self.drawn, self.changes, *self.variants.values()) for name in names)

    def _of_grids(self, draw: int) -> dict[str, Any]:
        """The combination of the grids' values in a draw; the last grid changes fastest."""
        chosen, rest = {}, draw
        for name, values in reversed(self.grids.items()):
            rest, index = divmod(rest, len(values))
            chosen[name] = values[index]
        return chosen

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
