"""Files that a person names: each reader takes a byte order mark, and refuses what it cannot read in one line with the path."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.scenario.fault_script import load_script
from vessel_hsmc_ros.scenario.scenario import load_scenario, read_changes
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.suite import load_suite

SECTION = "/**/vessel_sim: {ros__parameters: {seed: 4}}\n"
READERS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "scenario": (load_scenario, SECTION),
    "parameters": (read_changes, SECTION),
    "suite": (load_suite, "rows: [{name: one, at_most: 1.0}]\n"),
    "faults": (load_script, "faults: [{at: 1.0, kind: drop, topic: odom}]\n"),
    "vessel": (
        read_vessel,
        "vessel: {length: 3.0, beam: 1.2, surge_inertia: 300.0, sway_inertia: 400.0, yaw_inertia: 200.0, surge_damping: 60.0,"
        " sway_damping: 200.0, yaw_damping: 100.0}\n",
    ),
}


@pytest.mark.parametrize(("read", "text"), READERS.values(), ids=READERS)
def test_a_file_with_a_byte_order_mark_is_read_as_without(tmp_path: Path, read: Callable[[Path], Any], text: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(text.encode())
    plain = read(path)
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read(path) == plain


@pytest.mark.parametrize(("read", "text"), READERS.values(), ids=READERS)
def test_a_file_that_is_no_text_or_no_file_is_one_line_with_its_path(
    tmp_path: Path, read: Callable[[Path], Any], text: str
) -> None:
    path = tmp_path / "mine.yaml"

    def reason() -> str:
        with pytest.raises(VesselHsmcError, match=re.escape(str(path))) as raised:
            read(path)
        return str(raised.value)

    assert "\n" not in reason()
    path.write_bytes(text.encode() + "# Größe\n".encode("latin-1"))
    assert "utf-8" in reason()
    for broken in ("{", "", "- a\n", "a: &x [*x]\n", "a: 1\na: 2\n", "x: 2001-99-99\n"):
        path.write_text(broken, encoding="utf-8")
        assert "\n" not in reason(), broken
