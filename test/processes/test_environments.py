"""The command in unusual environments: C locale, closed streams, simple and narrow terminals, read-only folders."""

import os
import pty
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bag_making
import pytest
from durations import rest_long
from harness import BIN
from mounting import READ_ONLY, mounted

from vessel_hsmc_ros.cli.command import execute

C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
SECOND = ["--set", "vessel_sim.duration=1"]
LAWS = ["hierarchical_printed", "guided"]
COMPARE = ["compare", "case2_tracking", *SECOND, "--laws", ",".join(LAWS), "--workers", "1"]

VERBS = {
    "help": ["--help"],
    "parameters": ["parameters"],
    "report": ["report", "bag", "--csv", "--figures", "svg"],
    "replay": ["replay", "bag", "--verify"],
    "recover": ["recover", "bag"],
}

EACH = """
import sys
from vessel_hsmc_ros.cli.main import main
for name, arguments in {verbs!r}.items():
    sys.argv[1:] = arguments
    print(f"verb {{name}}", flush=True)
    try:
        code = main()
    except SystemExit as end:
        code = end.code or 0
    print(f"code {{code}}", flush=True)
"""


@pytest.mark.long
def test_in_the_c_locale_every_verb_works(tmp_path: Path) -> None:
    """In one process, as they share what they import."""
    bag_making.write_run(tmp_path / "bag", 20)
    command = [sys.executable, "-c", EACH.format(verbs=VERBS)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=180.0, env={**os.environ, **C_LOCALE})
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert done.stderr.isascii()
    assert b"Traceback" not in done.stderr
    codes = re.findall(r"^verb (\w+)$.*?^code (\d)$", done.stdout.decode(), re.MULTILINE | re.DOTALL)
    assert {name: int(code) for name, code in codes} == {**dict.fromkeys(VERBS, 0), "replay": 2}  # this bag has no scenario
    assert b"\nerror: bag bag was recorded without its scenario" in done.stderr
    (page,) = tmp_path.rglob("*.html")
    assert "N·m" in page.read_text(encoding="utf-8")


@pytest.mark.long
def test_a_run_of_the_nodes_works_in_the_c_locale_with_closed_standard_input(tmp_path: Path) -> None:
    line = '"$0" run case2_tracking --set vessel_sim.duration=1 --no-page <&-'
    command = ["sh", "-c", line, str(BIN / "vessel-hsmc")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120.0, env={**os.environ, **C_LOCALE})
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert b"N?m" in done.stdout
    assert b"run folder: " in done.stdout


@pytest.mark.parametrize(
    "arguments", rest_long([["vessels"], ["parameters", "--json"], ["scenarios", "case2_tracking"], ["--help"]])
)
def test_output_to_a_full_disk_ends_with_a_line_and_exit_code_1(arguments: list[str]) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run([BIN / "vessel-hsmc", *arguments], stdout=full, stderr=subprocess.PIPE, timeout=120.0, check=False)
    assert done.returncode == 1
    assert done.stderr == b"error: the output: No space left on device\n"


@pytest.mark.long
def test_a_terminal_of_unknown_width_has_tables_too() -> None:
    environment = {**os.environ, "COLUMNS": "0"}
    done = subprocess.run([BIN / "vessel-hsmc", "vessels"], capture_output=True, timeout=120.0, env=environment, check=True)
    assert b"otter" in done.stdout


def on_a_terminal(arguments: list[str], folder: Path, **environment: str) -> str:
    """The output of a command on a pseudo-terminal; it must exit with 0."""
    controller, terminal = pty.openpty()
    variables = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    process = subprocess.Popen(
        [BIN / "vessel-hsmc", *arguments],
        cwd=folder,
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env=variables | environment,
    )
    os.close(terminal)
    output = bytearray()
    try:
        while block := os.read(controller, 4096):
            output += block
    except OSError:  # Linux reports the end of a terminal as an error
        pass
    os.close(controller)
    assert process.wait(120.0) == 0, output.decode()
    return output.decode()


@pytest.mark.long
def test_a_dumb_terminal_gets_lines_without_control_sequences(tmp_path: Path) -> None:
    text = on_a_terminal(["simulate", "case2_tracking", *SECOND, "--no-page"], tmp_path, TERM="dumb")
    assert "\x1b" not in text
    assert text.startswith("simulating case2_tracking, 1 s\r\n")


@pytest.mark.long
def test_in_a_narrow_terminal_every_law_is_named(tmp_path: Path) -> None:
    text = on_a_terminal(COMPARE, tmp_path, TERM="xterm", COLUMNS="60", NO_COLOR="1")
    tables = text[text.index("case2_tracking  ") :]
    assert all(law in tables for law in LAWS)
    assert "…" not in tables


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[Path]:
    with mounted(tmp_path / "read_only", megabytes=1, flags=READ_ONLY) as disk:
        yield disk


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "case2_tracking"],
        ["simulate", "case2_tracking"],
        ["compare", "case2_tracking"],
        ["demo"],
        ["reproduce"],
        ["report", "bag"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_read_only_output_is_refused_in_one_line_before_anything_is_computed(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    read_only: Path,
    arguments: list[str],
) -> None:
    bag_making.write_run(tmp_path / "bag", 20)
    option, name = ("--file", "page.html") if arguments[0] == "report" else ("--output", "new")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", *arguments, option, str(read_only / name)])
    assert execute() == 1
    shown = capsys.readouterr()
    (line,) = (shown.out + shown.err).splitlines()
    assert line.startswith("error: ")
    assert str(read_only) in line
    assert line.endswith("Read-only file system")
