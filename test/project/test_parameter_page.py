"""The reference pages of parameters and boats, and the declarations from which they are generated."""

from pathlib import Path

from pages import interface_page, parameter_page, with_tables

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.scenario.parameters import NODES

DOCS = Path(__file__).parents[2] / "docs"


def test_the_pages_in_the_docs_are_generated_from_the_declarations() -> None:
    assert (DOCS / "parameters.md").read_text(encoding="utf-8") == parameter_page(), "run `make docs`"
    assert (DOCS / "boats.md").read_text(encoding="utf-8") == interface_page(), "run `make docs`"
    faults = (DOCS / "faults.md").read_text(encoding="utf-8")
    assert with_tables(faults) == faults, "run `make docs`"


def test_every_parameter_has_a_description_limits_and_an_allowed_default() -> None:
    for cls in NODES.values():
        for name, entry in schema.entries(cls).items():
            assert entry.description.endswith("."), name
            assert entry.type is bool or not isinstance(entry.default, float) or None not in (entry.low, entry.high), name
            assert schema.check(entry, entry.default, "node") == entry.default, name
