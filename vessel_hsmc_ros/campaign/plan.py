"""A campaign: one scenario, distributions over its parameters, and the runs that they define.

Run i is a pure function of the campaign file, the scenario and i, its noise included. A draw gives all drawn parameters a
value; its runs, one for each law, share these values and the noise, so that laws are compared on the same ships and seas:

    run = draw · (number of laws) + index of the law
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.campaign import sampling
from vessel_hsmc_ros.campaign.distributions import Grid
from vessel_hsmc_ros.campaign.drawn import Drawn
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.law_file import law_provenance
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario

SEED, LAW = "vessel_sim.seed", "controller.law"


class Source(NamedTuple):
    """The texts that define a campaign, from which any process can make it.

    Attributes:
        name: Name of the campaign: that of its file.
        text: Content of the campaign file.
        scenario_name: Name of the base scenario.
        scenario: Its ROS parameters file.
    """

    name: str
    text: str
    scenario_name: str
    scenario: str


class PlannedRun(NamedTuple):
    """The numbers that define a run: its number, draw, law, the seed of its noise, and the drawn values by their names."""

    run: int
    draw: int
    law: str
    seed: int
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Campaign:
    """A plan of runs with drawn parameters. `Campaign.load` makes one from a file, or from the folder of a campaign.

        campaign = Campaign.load("hull_uncertainty.yaml")
        run = simulate(campaign.scenario(48213))

    Attributes:
        source: The texts that define it.
        changes: Fixed changes to the scenario, by `node.parameter`.
        laws: The laws of each draw.
        repetitions: Number of draws, for each combination of the grids if there are any.
        sampling: One of `sampling.METHODS`.
        seed: Of all random numbers.
        parameters: The drawn parameters in the order of the file.
        limits: Largest magnitudes of metrics: a run above any is a failure.
        chunk: Number of runs in a file of the dataset.
    """

    source: Source
    changes: Mapping[str, object]
    laws: tuple[str, ...]
    repetitions: int
    sampling: str
    seed: int
    parameters: tuple[Drawn, ...]
    limits: Mapping[str, float]
    chunk: int

    @classmethod
    def load(cls, path: Path | str, runs: int | None = None) -> "Campaign":
        """Read and check a campaign.

        Args:
            path: A campaign of the package, such as `far_starts`; a YAML file; or the folder of a campaign that was run.
            runs: Number of draws in the place of that of the file.

        Raises:
            ScenarioError: the file is unknown, unreadable or malformed.
            ParameterError: a parameter, distribution, limit or law of it is not allowed.
            CampaignError: the folder is not that of a campaign.
        """
        from vessel_hsmc_ros.campaign.dataset import Dataset
        from vessel_hsmc_ros.campaign.plan_file import parse_campaign, read_source

        if Path(path).is_dir():
            dataset = Dataset(Path(path))
            return parse_campaign(dataset.read_source(), runs or dataset.read_repetitions())
        return parse_campaign(read_source(path), runs)

    @property
    def name(self) -> str:
        """Name of the campaign: that of its file."""
        return self.source.name

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
        return self.draws * len(self.laws)

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

    @cached_property
    def digest(self) -> str:
        """Hash of everything that the rows depend on: equal for campaigns of which one extends the other."""
        from vessel_hsmc_ros.campaign.plan_file import document

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
            raise ParameterError(f"run {run} is not allowed: the campaign {self.name} has the runs 0 to {self.runs - 1}")
        draw, law = divmod(run, len(self.laws))
        values = self.values(draw)
        own = sampling.noise_seed(self.seed, draw)
        return PlannedRun(run, draw, self.laws[law], int({SEED: own, **self.changes, **values}[SEED]), values)

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

    def scenario(self, run: int, changes: Mapping[str, object] | None = None) -> Scenario:
        """The scenario of a run.

        Args:
            run: Its number.
            changes: Further changes by `node.parameter` that do not affect the results, such as those of `for_nodes`.

        Raises:
            ParameterError: the campaign has no such run, or its drawn values do not fit each other.
            ScenarioError: the rates do not fit each other.
        """
        planned = self.planned(run)
        drawn = self._with_lists(planned.values)
        return self._scenario({**self.changes, **drawn, SEED: planned.seed, LAW: planned.law, **(changes or {})})

    @cached_property
    def base(self) -> Scenario:
        """The scenario with its fixed changes and the first law."""
        return self._scenario({**self.changes, LAW: self.laws[0]})

    def _scenario(self, changes: Mapping[str, object]) -> Scenario:
        return parse_scenario(self.source.scenario, self.source.scenario_name, changes, f"scenario of {self.name}")

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
