"""A single row of a campaign: its scenario, and the comparison of a run with it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.campaign.dataset import Dataset, read_chunk
from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import Scenario


@dataclass(frozen=True)
class Row:
    """A row of a campaign that was run.

    Attributes:
        campaign: The campaign.
        run: Number of the row.
        values: Its columns by their names; empty if it is not computed yet.
    """

    campaign: Campaign
    run: int
    values: Mapping[str, Any]

    @classmethod
    def read(cls, folder: Path | str, run: int) -> "Row":
        """Read a row.

        Raises:
            ParameterError: the campaign has no such row.
            CampaignError: the folder is not that of a campaign, or the file of the row is damaged.
        """
        campaign = Campaign.of_folder(folder)
        campaign.planned(run)  # checks the number
        path = Dataset(Path(folder)).chunk_path(run // campaign.chunk)
        rows = read_chunk(path, campaign).to_pylist() if path.exists() else []
        return cls(campaign, run, next((row for row in rows if row["run"] == run), {}))

    def scenario(self, changes: Mapping[str, object] | None = None) -> Scenario:
        """The scenario of the row, in lockstep; with changes that do not affect its results, such as those of `for_nodes`."""
        return self.campaign.scenario(self.run, {**{f"{node}.lockstep": True for node in NODES}, **(changes or {})})

    def differences(self, metrics: Metrics | None, failure: str = "") -> list[str]:
        """Compare a run with the row.

        Args:
            metrics: Metrics of the run; None where it has none.
            failure: Why it ended early; empty if it did not.

        Returns:
            A line for each difference; none if all metrics are bit-identical, or both ended early for the same reason.
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
            if name in self.values and not _equal(self.values[name], value)  # older rows have fewer metrics
        ]


def _equal(a: float | None, b: float | None) -> bool:
    """Whether two metrics are the same number, both NaN or both None."""
    return a == b or (a is not None and b is not None and math.isnan(a) and math.isnan(b))
