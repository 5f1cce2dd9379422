"""The reference page of the parameters, and the declarations from which it is generated."""

from pathlib import Path

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.scenario.parameter_page import matching, parameter_page
from vessel_hsmc_ros.scenario.parameters import AUXILIARY, NODES, WATCHERS


def test_the_page_in_the_docs_is_generated_from_the_declarations() -> None:
    page = Path(__file__).parents[2] / "docs" / "parameters.md"
    assert page.read_text(encoding="utf-8") == parameter_page(), "run `make docs`"


def test_every_parameter_has_a_description_limits_and_an_allowed_default() -> None:
    for cls in NODES.values():
        for name, entry in schema.entries(cls).items():
            assert entry.description.endswith("."), name
            assert entry.type is bool or not isinstance(entry.default, float) or None not in (entry.low, entry.high), name
            assert schema.check(entry, entry.default, "node") == entry.default, name


def test_a_word_is_found_in_names_and_meanings_whatever_its_case() -> None:
    named = [record["name"] for record in matching("heartbeat_TIMEOUT")]
    assert named == ["watchdog.heartbeat_timeout", "mavlink.heartbeat_timeout", "px4.heartbeat_timeout"]
    assert [record["name"] for record in matching("WatchDog.Ramp")] == ["watchdog.ramp_time"]
    for word in ("vehiclestatus", "pierson"):
        assert matching(word) == matching(word.upper()) != []
    declared = [f"{node}.{name}" for node, cls in (NODES | AUXILIARY | WATCHERS).items() for name in schema.entries(cls)]
    assert [record["name"] for record in matching("")] == declared
