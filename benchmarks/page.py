"""The page of measured results, docs/results.md, and the table of README.md.

benchmarks/results.yaml declares what is measured: a command, what of its output is a figure, and the code that it measures.
benchmarks/results.json keeps what was measured, with date, commit and machine. The commit is the last one that changed the
measured code; the pages show no figures of a row whose code has changed since.

    python benchmarks/page.py                     # run the quick commands, write the pages
    python benchmarks/page.py --only circle rest  # run these, quick or not
    python benchmarks/page.py --no-run            # write the pages only
"""

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from itertools import groupby
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.core.quantities import quantity

ROOT = Path(__file__).resolve().parents[1]
STORE = ROOT / "benchmarks" / "results.json"
README_LAWS = ("hierarchical", "guided", "los_pid")
"""Columns of the table of README.md: named groups of the rows with `readme`."""
GENERATED = re.compile(r"(<!-- generated: results -->\n).*?(<!-- end -->)", re.DOTALL)
TIME_LIMIT = 4 * 3600.0
"""Largest duration of a command, s."""

Results = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Row:
    """What is measured: a line of docs/results.md."""

    name: str
    what: str
    command: str
    code: list[str]
    section: str = ""
    read: str = ""
    """File that the command writes and whose text belongs to its output, as a glob in the empty folder."""
    figures: str = ""
    """Regular expression of the figures in the output."""
    shown: str = ""
    """What the page shows, with the groups of `figures` in braces."""
    readme: str = ""
    """Name of the line in README.md."""
    quick: bool = False


def declared_rows() -> list[Row]:
    """The rows of benchmarks/results.yaml, each with the paths of its code."""
    declared = yaml.safe_load((ROOT / "benchmarks" / "results.yaml").read_text(encoding="utf-8"))
    rows = []
    for name, entry in declared["rows"].items():
        groups = entry.pop("code")
        paths = [path for group in groups for path in declared["code"][group]]
        command = entry["command"]
        if command.startswith("python benchmarks/"):
            paths.append(command.split()[1])
        rows.append(Row(name=name, code=paths, **entry))
    return rows


def stored_results() -> Results:
    """What has been measured, by the name of the row."""
    return dict(json.loads(STORE.read_text(encoding="utf-8"))) if STORE.exists() else {}


def git(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run git in the repository."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S607


def commit_of(paths: Iterable[str]) -> str:
    """The last commit that changed the paths, with a plus sign where they have changed since.

    Raises:
        FileNotFoundError: one of the paths does not exist.
    """
    paths = list(paths)
    for path in paths:
        if not (ROOT / path).exists():
            raise FileNotFoundError(f"benchmarks/results.yaml: measured code {path} does not exist")
    commit = git("log", "-1", "--format=%h", "--abbrev=8", "--", *paths).stdout.strip()
    return commit + ("+" if git("status", "--porcelain", "--", *paths).stdout else "")


def is_older(result: Mapping[str, Any], paths: Iterable[str]) -> bool:
    """Whether the measured code has changed since the measurement, or its commit is not known."""
    commit = result.get("commit")
    if not commit or commit.endswith("+"):
        return True
    return git("diff", "--quiet", commit, "--", *paths).returncode != 0


def machine() -> str:
    """Cores, processor and Python of this machine."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        model = re.sub(r"\s+", " ", re.findall(r"model name\s*: (.*)", lines)[0])
    except (OSError, IndexError):
        model = platform.machine()
    return f"{os.cpu_count()} cores, {model}, Python {platform.python_version()}"


def measure(row: Row) -> dict[str, Any]:
    """Run the command of a row: the repository's own programs in it, others in an empty folder.

    Raises:
        RuntimeError: the output has no such figures.
    """
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "250"}
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            ["bash", "-c", row.command],  # noqa: S607
            cwd=ROOT if row.command.startswith(("python benchmarks/", "make ")) else folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
            check=False,
        )
        written = [path.read_text(encoding="utf-8") for path in Path(folder).glob(row.read)] if row.read else []
    figures = figures_in(row, "".join([done.stdout, *written]))
    if not figures:
        raise RuntimeError(f"{row.name}: no figures in the output of {row.command}:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return {
        "figures": figures,
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
        "commit": commit_of(row.code),
        "machine": machine(),
        "seconds": round(time.monotonic() - began),
    }


def figures_in(row: Row, output: str) -> dict[str, str]:
    """The figures of a command's output by the names of the groups, those of laws as lengths."""
    found = re.search(row.figures, output, re.DOTALL | re.MULTILINE)
    figures = {name: (value or "–").strip() for name, value in found.groupdict().items()} if found else {}
    return {name: as_length(value) if name in README_LAWS else value for name, value in figures.items()}


def as_length(text: str) -> str:
    """A number of metres with its unit; what is no number stays."""
    try:
        return quantity(float(text), "m")
    except ValueError:
        return text


def shown(row: Row, result: Mapping[str, Any]) -> str:
    """The figures of a row as the page shows them."""
    return row.shown.format(**result["figures"])


def readme_table(rows: Iterable[Row], results: Results) -> str:
    """The table of README.md: a line for each fresh row with a name for it, a column for each law."""
    lines = ["| | " + " | ".join(f"`{law}`" for law in README_LAWS) + " | commit |", "|---" * (2 + len(README_LAWS)) + "|"]
    for row in rows:
        result = results[row.name]
        if row.readme and not result["older"]:
            cells = " | ".join(result["figures"][law] for law in README_LAWS)
            lines.append(f"| {row.readme} | {cells} | `{result['commit']}` |")
    return "\n".join(lines)


def with_readme_table(text: str, rows: Iterable[Row], results: Results) -> str:
    """README.md with the present table between its markers."""
    return GENERATED.sub(lambda match: f"{match[1]}{readme_table(rows, results)}\n{match[2]}", text)


def results_page(rows: Iterable[Row], results: Results) -> str:
    """The text of docs/results.md: the figures of the present code; a row whose code has changed since has none."""
    rows = list(rows)
    machines = list(dict.fromkeys(results[row.name]["machine"] for row in rows if not results[row.name]["older"]))
    text = [
        "# Results",
        "",
        "Written by `make benchmark-page` from `benchmarks/results.yaml` and `benchmarks/results.json`; not to be edited.",
        "The commit is the last one that changed the measured code. A row without figures has not been measured since.",
        "The pace of the machine varies by a factor of two with the load of its host.",
    ]
    for section, members in groupby(rows, lambda row: row.section):
        text += ["", f"## {section}", "", "| what | measured | command | date, commit, machine |", "|---|---|---|---|"]
        text += [result_line(row, results[row.name], machines) for row in members]
    text += ["", "## Machines", "", *(f"{number}. {each}" for number, each in enumerate(machines, 1)), ""]
    return "\n".join(text)


def result_line(row: Row, result: Mapping[str, Any], machines: list[str]) -> str:
    """The line of a row; the machine is given by its number in the list."""
    measured = origin = "–"
    if not result["older"]:
        measured = shown(row, result)
        origin = f"{result['date']}, `{result['commit']}`, {1 + machines.index(result['machine'])}"
    command = f"`{row.command}`".replace("|", "\\|")
    return f"| {row.what} | {measured} | {command} | {origin} |"


def write(rows: list[Row], results: Results) -> None:
    """Find what is older than its code, and write results.json, the page and the table of README.md."""
    rows = [row for row in rows if row.name in results]
    results = {row.name: results[row.name] for row in rows}
    for row in rows:
        results[row.name]["older"] = is_older(results[row.name], row.code)
    STORE.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    (ROOT / "docs" / "results.md").write_text(results_page(rows, results), encoding="utf-8")
    readme = ROOT / "README.md"
    readme.write_text(with_readme_table(readme.read_text(encoding="utf-8"), rows, results), encoding="utf-8")


def main() -> int:
    """Measure what is wanted and write the pages; the exit code is 1 where a command gave no figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="rows to measure, quick or not")
    parser.add_argument("--no-run", action="store_true", help="measure nothing")
    arguments = parser.parse_args()
    rows, results, failed = declared_rows(), stored_results(), False
    unknown = set(arguments.only or ()) - {row.name for row in rows}
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}; rows are {', '.join(row.name for row in rows)}")
    for row in rows:
        if arguments.no_run or not (row.name in arguments.only if arguments.only else row.quick):
            continue
        try:
            results[row.name] = measure(row)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            print(error, file=sys.stderr)
            failed = True
        else:
            print(f"{row.name}: {shown(row, results[row.name])}", flush=True)
    write(rows, results)
    missing = [row.name for row in rows if row.name not in results]
    if missing:
        print(f"no result yet, left out: {', '.join(missing)}", file=sys.stderr)
    return int(failed or bool(missing))


if __name__ == "__main__":
    sys.exit(main())
