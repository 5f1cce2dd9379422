"""Tables for other programs, and figures as files."""

import csv
import re
import sys
from pathlib import Path

import bag_making
import numpy as np
import pytest
from durations import rest_long
from pyarrow import parquet
from records import circle, make_run, record

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.metrics import MOTION
from vessel_hsmc_ros.report import figures, page
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

ROOT = Path(__file__).parents[2]


def test_csv_reads_back_bit_identical(tmp_path: Path) -> None:
    run = circle(1.0)
    paths = page.write_csv(run, tmp_path / "csv")
    assert [path.name for path in paths] == ["motion.csv", "control.csv"]
    read = np.genfromtxt(paths[0], delimiter=",", names=True)
    np.testing.assert_array_equal(read["time"], run.time)
    np.testing.assert_array_equal(read["reference_y"], run.reference[:, 1])
    np.testing.assert_array_equal(read["yaw_moment"], run.wrench[:, 1])


def test_csv_has_a_row_for_each_state_and_lines_end_as_on_unix(tmp_path: Path) -> None:
    path = page.write_csv(circle(1.0), tmp_path)[0]
    text = path.read_bytes()
    assert b"\r" not in text
    rows = list(csv.reader(text.decode().splitlines()))
    assert len(rows) == 1 + 500
    assert {len(row) for row in rows} == {len(rows[0])}


def test_flags_are_written_as_0_and_1(tmp_path: Path) -> None:
    run = circle(1.0)
    run.control["saturated"] = np.arange(250) % 2 == 0
    rows = list(csv.DictReader((page.write_csv(run, tmp_path)[1]).open()))
    assert [row["saturated"] for row in rows[:3]] == ["1", "0", "1"]


def test_weights_of_networks_are_not_exported(tmp_path: Path) -> None:
    read = np.genfromtxt(page.write_csv(circle(1.0), tmp_path)[1], delimiter=",", names=True)
    assert read.dtype.names == ("time", "surge_estimate")


def test_quantities_that_were_not_recorded_have_no_columns() -> None:
    run = circle(1.0)
    tables = page.tables(make_run(run.time, run.state))
    assert list(tables) == ["motion"]
    assert list(tables["motion"]) == ["time", *MOTION]


def test_every_column_is_documented_and_every_documented_column_exists(tmp_path: Path) -> None:
    bag_making.write_run(tmp_path / "bag", 20)
    changes = {"vessel_sim.duration": 0.1}
    # A bag has every topic; a simulation with noise and observer has the rest.
    runs = [open_bag(tmp_path / "bag").run(load_scenario("realistic").vessel_sim.vessel.coefficients(), weights=False)]
    runs.append(simulate(load_scenario("realistic", changes)))
    runs[0].control["commanded"] = np.zeros((len(runs[0].control["time"]), 2))
    found = [page.tables(run) for run in runs]
    text = (ROOT / "docs" / "report.md").read_text(encoding="utf-8").partition("## Columns of the tables")[2]
    motion, _, control = text.partition("`control`, a row")
    for name, section in (("motion", motion), ("control", control.partition("\n## ")[0])):
        documented = set(re.findall(r"`(\w+)`", "".join(line.split("|")[1] for line in section.splitlines() if "|" in line)))
        assert documented == {column for tables in found for column in tables[name]}


def test_errors_of_the_paper_cannot_be_mistaken_for_errors_in_the_body_frame() -> None:
    run = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": 1.0}))
    tables = page.tables(run)
    assert "surge_error" not in tables["control"]
    np.testing.assert_array_equal(tables["control"]["paper_z1e"], run.control["surge_error"])
    np.testing.assert_array_equal(tables["control"]["paper_z2e_rate"], run.control["sway_error_rate"])
    error = np.hypot(tables["motion"]["body_error_x"], tables["motion"]["body_error_y"])
    np.testing.assert_allclose(error, tables["motion"]["position_error"])


def test_parquet_has_the_same_columns(tmp_path: Path) -> None:
    run = circle(1.0)
    paths = page.write_parquet(run, tmp_path)
    assert [path.name for path in paths] == ["motion.parquet", "control.parquet"]
    for path, table in zip(paths, page.tables(run).values(), strict=True):
        read = parquet.read_table(path)
        assert read.column_names == list(table)
        for name, values in table.items():
            np.testing.assert_array_equal(read[name].to_numpy(), values)


def test_parquet_without_pyarrow_is_refused_with_a_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ReportError, match="Parquet needs pyarrow, which is not installed: pip install pyarrow"):
        page.write_parquet(circle(1.0), tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ReportError, match=r"tables in .*file/csv cannot be written: Not a directory"):
        page.write_csv(circle(1.0), tmp_path / "file" / "csv")


@pytest.mark.parametrize(("kind", "start"), rest_long([("png", b"\x89PNG"), ("svg", b"<?xml")]))
def test_figures_are_files_of_the_requested_kind(tmp_path: Path, kind: str, start: bytes) -> None:
    paths = figures.draw([record("near", 1.0), record("far", 4.0)], tmp_path / "figures", kind)
    assert {path.name for path in paths} >= {f"track.{kind}", f"errors.{kind}", f"wrench.{kind}"}
    assert all(path.read_bytes().startswith(start) for path in paths)
