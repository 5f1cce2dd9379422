"""Fuzzing of the reader of campaigns; the form of a target is that of `fuzz_targets`."""

import math
from collections.abc import Mapping
from typing import Any

from fuzz_findings import Finding, decided

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.parameters_file import read_yaml
from vessel_hsmc_ros.studies.campaign.plan import KEYS, Campaign, Source

DRAWS = 5
"""Draws of an accepted campaign whose values are looked at."""


def campaign(data: bytes, scenario: str) -> Campaign | None:
    """A campaign that is accepted; what it draws is what the file states, and within the declared ranges.

    Args:
        data: The file.
        scenario: The text of the base scenario.
    """
    found = decided(lambda: Campaign.parse(Source("fuzz", data.decode(errors="replace"), "case2_tracking", scenario)))
    if found is None:
        return None
    given = read_yaml(data.decode(errors="replace"))
    _require(not set(given) - set(KEYS), f"the keys {list(given)} were accepted")
    _require(found.repetitions >= 1 and found.chunk >= 1 and found.seed >= 0, f"{found} was accepted")
    _require(set(found.laws) <= set(LAWS) and len(set(found.laws)) == len(found.laws) > 0, f"laws {found.laws} were accepted")
    for name, limit in found.limits.items():
        _require(name in Metrics._fields and 0.0 <= limit < math.inf, f"the limit {name} = {limit} was accepted")
    drawn = given.get("draw") or {}
    _require(list(found.drawn) == list(drawn), f"{found.drawn} are drawn, the file has {list(drawn)}")
    for draw in range(min(DRAWS, found.draws)):
        _require_values(found, drawn, found.values(draw))
    return found  # type: ignore[no-any-return]


def _require_values(found: Campaign, given: Mapping[str, Any], values: Mapping[str, Any]) -> None:
    """Raise a Finding for a value outside the range of its parameter or of its distribution."""
    for parameter in found.parameters:
        value, stated = values[parameter.name], given[parameter.name]
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        low, high = parameter.limits
        _require(low <= value <= high and not math.isnan(value), f"{parameter.name} = {value} was drawn")
        if "uniform" in stated and not stated.get("relative"):
            begin, end = stated["uniform"]
            _require(begin <= value <= end, f"{parameter.name} = {value} was drawn from {stated}")
        _require("normal" not in stated or stated["normal"][1] > 0.0, f"{parameter.name}: {stated} was accepted")


def _require(holds: bool, text: str) -> None:
    if not holds:
        raise Finding(text)
