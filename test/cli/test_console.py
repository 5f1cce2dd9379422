"""Tables and progress bars of the command, in a terminal and in a log file."""

import io
import resource
from pathlib import Path

import pytest
from rich.console import Console

import vessel_hsmc_ros.cli.console as console_module
from vessel_hsmc_ros.cli.console import print_error, print_line, print_table, progress_bar, write_new
from vessel_hsmc_ros.core.exceptions import ScenarioError


def test_without_a_terminal_progress_is_a_title_and_the_given_lines(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("comparing", 2, "runs") as update:
        update(1, "1 of 2: los_pid on circle")
        update(2)
    captured = capsys.readouterr()
    assert captured.err.splitlines() == ["comparing, 2 runs", "1 of 2: los_pid on circle"]
    assert captured.out == ""


def test_progress_of_unknown_length_shows_no_total(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("running case2_tracking", 0.0) as update:
        update(3.0)
    assert capsys.readouterr().err.splitlines() == ["running case2_tracking"]


def test_in_a_narrow_terminal_text_is_wrapped_and_numbers_stay_in_one_piece() -> None:
    out = io.StringIO()
    numbers = ["0.00075 m hit", "0.0097 m miss", "6.6e-05 m hit", "2 m miss"]
    row = ["damping increased by half", "last quarter", "0.02 m", *numbers]
    console = Console(width=80, file=out, color_system=None)
    print_table(["case", "over", "limit", *"abcd"], [row], text_columns=3, console=console)
    assert all(number in out.getvalue() for number in numbers)
    assert "…" not in out.getvalue()


def test_names_of_ordinary_length_are_not_broken_in_a_narrow_terminal() -> None:
    out = io.StringIO()
    row = ["turn_acceleration_share", "derived", "leaves moment for the disturbance; little where the moment is slow", "0.145"]
    print_table(["gain", "origin", "reason", "value"], [row], text_columns=3, console=Console(width=60, file=out))
    assert "turn_acceleration_share" not in out.getvalue()  # longer than a third of the width
    out = io.StringIO()
    print_table(["gain", "origin", "reason", "value"], [row], text_columns=3, console=Console(width=80, file=out))
    assert "turn_acceleration_share" in out.getvalue()
    assert "0.145" in out.getvalue()


def test_a_table_without_names_has_no_header(capsys: pytest.CaptureFixture[str]) -> None:
    print_table(["", ""], [("position error, final", "24.0 m")])
    assert capsys.readouterr().out.split() == ["position", "error,", "final", "24.0", "m"]


def test_paths_and_brackets_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    path = "/runs/[red]" + "x" * 200
    print_line(path)
    print_error(f"{path} does not exist")
    captured = capsys.readouterr()
    assert captured.out == f"{path}\n"
    assert captured.err == f"error: {path} does not exist\n"


LAW_NAMES = ["hierarchical_printed", "guided", "los_pid", "nmpc"]


@pytest.mark.parametrize("width", [40, 60, 200])
def test_a_table_of_any_width_shows_every_name_and_every_number(width: int) -> None:
    out = io.StringIO()
    head = ["law", *(f"metric {number}" for number in range(8))]
    rows = [[name, *(f"{place}.{number}e+03 m" for number in range(8))] for place, name in enumerate(LAW_NAMES)]
    print_table(head, rows, console=Console(width=width, file=out, color_system=None))
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    for row in rows:
        of_law = [line.split(row[0], 1)[1] for line in lines if row[0] in line]
        assert " ".join(" ".join(of_law).split()) == " ".join(row[1:])


@pytest.mark.parametrize("width", [40, 60])
def test_laws_as_columns_are_all_named_in_a_narrow_terminal(width: int) -> None:
    out = io.StringIO()
    print_table(
        ["", *LAW_NAMES],
        [["position error, rms of the last quarter", *["0.00075 m hit"] * 4]],
        console=Console(width=width, file=out),
    )
    assert all(name in out.getvalue() for name in LAW_NAMES)
    assert out.getvalue().count("0.00075 m hit") == len(LAW_NAMES)


@pytest.mark.parametrize("terminal", ["dumb", "unknown"])
def test_a_terminal_without_cursor_control_gets_lines_instead_of_a_bar(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], terminal: str
) -> None:
    monkeypatch.setenv("TERM", terminal)
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, for Rich
    with progress_bar("running", 100.0) as update:
        update(50.0, "half")
    assert capsys.readouterr().err.splitlines() == ["running, 100 s", "half"]


def test_without_a_terminal_each_tenth_of_the_progress_is_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console_module, "LINE_PERIODS", (-1.0, 1e9))
    with progress_bar("running", 400.0) as update:
        for time in range(401):
            update(float(time))
    assert capsys.readouterr().err.splitlines() == ["running, 400 s", *(f"running: {tenth}0 %" for tenth in range(1, 10))]


def test_without_a_terminal_and_a_total_the_amount_is_a_line_every_few_seconds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console_module, "LINE_PERIODS", (-1.0, -1.0))
    with progress_bar("running", None) as update:
        update(12.3)
    assert capsys.readouterr().err.splitlines() == ["running", "running: 12 s"]


def test_a_file_that_does_not_fit_on_the_disk_leaves_no_part_of_it(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(ScenarioError, match="cannot be written: File too large"):
            write_new(tmp_path / "boat.yaml", "controller: 1\n" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())
