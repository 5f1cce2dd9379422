"""Draws mutants at random from the code that changed since a commit, and runs the tests that cover each changed line.

    python test/mutants/draw.py [--since HEAD~1] [--count 30] [--minutes 15] [--seed 1] [FILE ...]

First the tests that may concern the files run once, interpreted and with coverage by test: those of the same room, and those
that name a module. Then each mutant is tested by what covers its line, the tests of the fewest lines first. Prints the share that
is noticed by room. A survivor is a question, not yet a missing test: some changes have no effect. The exit code is 0.
"""

import argparse
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from coverage import CoverageData
from rich.console import Console
from rich.table import Table

TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TEST), str(TEST / "support")]

from mutants.operators import Change, changes  # noqa: E402
from mutants.run import FAILED, PASSED, run_tests  # noqa: E402
from source_tree import ROOT, copy_source  # noqa: E402

PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")
MOST_TESTS = 40
"""Tests that a mutant is tested by, those of the fewest lines first, which are about it."""

Lines = dict[str, set[int]]


class Drawn(NamedTuple):
    """A mutant: its file and its change."""

    file: str
    change: Change

    @property
    def room(self) -> str:
        """The room of its file."""
        return room_of(self.file)


def room_of(file: str) -> str:
    """The folder of tests for a file of the packages."""
    package, *rest = Path(file).parts
    return "plant" if package == PACKAGES[1] else rest[0] if len(rest) > 1 else "project"


def changed_lines(diff: str) -> Lines:
    """The lines of Python files that a difference without context adds, by file."""
    found: Lines = defaultdict(set)
    file = ""
    for line in diff.splitlines():
        if line.startswith("+++ "):
            file = line.removeprefix("+++ b/")
        elif (hunk := re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)) and file.endswith(".py"):
            first, count = int(hunk[1]), int(hunk[2] or 1)
            found[file] |= set(range(first, first + count))
    return found


def lines_to_change(since: str, files: Collection[str]) -> Lines:
    """The lines that changed since a commit, or all of some files."""
    if files:
        return {file: set(range(1, 1 + (ROOT / file).read_text(encoding="utf-8").count("\n"))) for file in files}
    command = ["git", "diff", "--unified=0", since, "--", *PACKAGES]
    return changed_lines(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def concerned(files: Collection[str]) -> list[str]:
    """The files of tests in the rooms of some files, and those that name one of their modules; none of processes."""
    rooms, stems = {room_of(file) for file in files}, "|".join(sorted(Path(file).stem for file in files))
    named, found = re.compile(rf"\b(?:{stems})\b"), []
    for path in sorted((ROOT / "test").rglob("test_*.py")):
        room = path.relative_to(ROOT / "test").parts[0]
        if room not in ("processes", "project", "security") and (room in rooms or named.search(path.read_text(encoding="utf-8"))):
            found.append(path.relative_to(ROOT).as_posix())
    return found


def covering(tree: Path, tests: Collection[str], seconds: float) -> Mapping[str, Mapping[int, list[str]]]:
    """The tests that run each line of each file of a copy of the tree; for tests that pass.

    Raises:
        SystemExit: one fails on the unchanged source.
    """
    data = tree / "coverage.data"
    options = ["--cov", "--cov-report=", "--cov-context=test", "--cov-fail-under=0"]
    code = run_tests(tree, [*options, *tests], seconds, COVERAGE_FILE=str(data))
    if code != PASSED:
        raise SystemExit(f"the tests {'do not pass' if code == FAILED else 'do not end in time'} on the unchanged source")
    read = CoverageData(str(data))
    read.read()
    found: dict[str, dict[int, list[str]]] = {}
    for path in read.measured_files():
        contexts = read.contexts_by_lineno(path)
        by_line = {line: sorted({each.partition("|")[0] for each in names if each}) for line, names in contexts.items()}
        found[Path(path).relative_to(tree).as_posix()] = by_line
    return found


def judge(drawn: Drawn, tree: Path, tests: Collection[str], seconds: float) -> str:
    """Return "noticed", "survived" or "not covered"."""
    if not tests:
        return "not covered"
    path = tree / drawn.file
    source = path.read_text(encoding="utf-8")
    path.write_text(drawn.change.applied(source), encoding="utf-8")
    try:
        code = run_tests(tree, list(tests), seconds)
    finally:
        path.write_text(source, encoding="utf-8")
    return "survived" if code == PASSED else "noticed"


def report(verdicts: Mapping[Drawn, str], console: Console) -> None:
    """Print the survivors, and the share noticed by room."""
    for drawn, verdict in verdicts.items():
        if verdict != "noticed":
            where, change = f"{drawn.file}:{drawn.change.line}", drawn.change
            console.print(f"{verdict}: {where}: {change.kind}: {change.text}", highlight=False, markup=False)
    table = Table("room", "drawn", "noticed", "survived", "not covered")
    rooms = sorted({drawn.room for drawn in verdicts})
    for room in [*rooms, "all"]:
        those = [verdict for drawn, verdict in verdicts.items() if room in (drawn.room, "all")]
        table.add_row(room, str(len(those)), *(str(those.count(each)) for each in ("noticed", "survived", "not covered")))
    console.print(table)


def main() -> int:
    """Draw, judge and report, within the time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", help="files of the packages, in the place of what changed")
    parser.add_argument("--since", default="HEAD~1", help="the commit since which the code changed")
    parser.add_argument("--count", type=int, default=30, help="number of mutants")
    parser.add_argument("--minutes", type=float, default=15.0, help="time limit")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    given = parser.parse_args()
    console, end = Console(width=160), time.monotonic() + 60.0 * given.minutes
    lines = lines_to_change(given.since, given.files)
    every = [Drawn(f, c) for f, those in sorted(lines.items()) for c in changes((ROOT / f).read_text(encoding="utf-8"), those)]
    if not every:
        console.print(f"no code has changed since {given.since}")
        return 0
    chosen = random.Random(given.seed).sample(every, min(given.count, len(every)))  # noqa: S311 - no secret
    os.environ.setdefault("PYTHONHASHSEED", "0")
    with tempfile.TemporaryDirectory(prefix="mutants_") as folder:
        tree = copy_source(Path(folder) / "tree")
        tests = concerned({drawn.file for drawn in chosen})
        console.print(f"{len(chosen)} of {len(every)} mutants; {len(tests)} files of tests run once with coverage")
        by_file = covering(tree, tests, end - time.monotonic())
        size: dict[str, int] = defaultdict(int)
        for by_line in by_file.values():
            for names in by_line.values():
                for name in names:
                    size[name] += 1
        verdicts: dict[Drawn, str] = {}
        for drawn in chosen:
            if time.monotonic() > end:
                console.print(f"the time is over: {len(chosen) - len(verdicts)} mutants are not judged")
                break
            by_line = by_file.get(drawn.file, {})
            # A line that runs at the import, such as a constant, is covered by whatever runs another line of its file.
            names = by_line.get(drawn.change.line) or sorted({name for those in by_line.values() for name in those})
            verdicts[drawn] = judge(drawn, tree, sorted(names, key=size.__getitem__)[:MOST_TESTS], end - time.monotonic() + 60.0)
    report(verdicts, console)
    return 0


if __name__ == "__main__":
    sys.exit(main())
