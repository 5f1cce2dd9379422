"""Tables and progress bars of the command, in a terminal and in a log file."""

import io

import pytest
from rich.console import Console

from vessel_hsmc_ros.cli.console import print_error, print_line, print_table, progress_bar


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
