"""Mutation check: apply each known bug of `test/mutants/*.yaml` to a copy of the source tree and run the test that must fail.

    python test/mutants/run.py [NAME ...] [--jobs 2]

Each file is a list of entries {id, file, find, replace, test, why}: `find` occurs exactly once in `file` and is replaced by
`replace`. A mutant is killed if its test passes on the unchanged copy and fails on the mutated one. The exit code is 1 if a
mutant survives or cannot be judged. NAME selects files by stem or entries by id.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import yaml
from rich.console import Console
from rich.table import Table

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent / "support"))

from source_tree import copy_source  # noqa: E402

TIMEOUT = 300.0
PASSED, FAILED = 0, 1
"""Exit codes of pytest; any other one, for example of a collection error, is no verdict."""


@dataclass(frozen=True)
class Mutant:
    """One plausible bug and the test that detects it."""

    id: str
    file: str
    find: str
    replace: str
    test: str
    why: str

    def apply(self, tree: Path) -> str:
        """Write the mutated file into a copy of the source tree and return the original text.

        Raises:
            ValueError: `find` does not occur exactly once in the file, or `replace` does not change it
        """
        path = tree / self.file
        text = path.read_text(encoding="utf-8")
        count = text.count(self.find)
        if count != 1:
            raise ValueError(f"the text to replace occurs {count} times in {self.file}")
        if self.find == self.replace:
            raise ValueError("the replacement is the same text")
        path.write_text(text.replace(self.find, self.replace), encoding="utf-8")
        return text


LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML, where it is installed, reads the lists ten times as fast: all of them are read whenever tests are collected."""


def load(names: list[str] | None = None) -> list[Mutant]:
    """Read the mutants whose id or whose file's stem is in `names`; all of them without names."""
    mutants = []
    for path in sorted(FOLDER.glob("*.yaml")):
        for entry in yaml.load(path.read_text(encoding="utf-8"), LOADER) or ():  # noqa: S506 - it is a safe one
            if not names or path.stem in names or entry["id"] in names:
                mutants.append(Mutant(**entry))
    return mutants


def run_tests(tree: Path, tests: Sequence[str], timeout: float = TIMEOUT, **variables: str) -> int | None:
    """Run tests in a copy of the source tree, to the first that fails, and return pytest's exit code, None after the time-out.

    A test that hangs on a mutant counts as failed, hence the session of its own: its child processes are killed with it.

    Args:
        tree: The copy.
        tests: Names of tests, and options of pytest.
        timeout: s.
        variables: Further variables of the environment.
    """
    # Interpreted: to compile a mutant takes longer than its test.
    own = {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_DISABLE_JIT": "1"}
    environment = os.environ | own | variables
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    with subprocess.Popen(
        command, cwd=tree, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        try:
            return process.wait(timeout)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            return None


def judge(mutant: Mutant, tree: Path) -> str:
    """Return "killed", "survived", or the reason why neither can be concluded."""
    if run_tests(tree, [mutant.test]) != PASSED:
        return "its test does not pass on the unchanged source"
    try:
        original = mutant.apply(tree)
    except ValueError as error:
        return str(error)
    try:
        code = run_tests(tree, [mutant.test])
    finally:
        (tree / mutant.file).write_text(original, encoding="utf-8")
    if code in (FAILED, None):
        return "killed"
    return "survived" if code == PASSED else f"pytest ended with exit code {code}"


def judge_all(mutants: list[Mutant], jobs: int, console: Console) -> list[str]:
    """Judge the mutants in `jobs` copies of the source tree at a time; the verdicts in their order."""
    with tempfile.TemporaryDirectory(prefix="mutants_") as folder, ThreadPoolExecutor(jobs) as pool:
        trees: SimpleQueue[Path] = SimpleQueue()
        for number in range(jobs):
            trees.put(copy_source(Path(folder) / str(number)))

        def work(mutant: Mutant) -> str:
            tree = trees.get()
            try:
                verdict = judge(mutant, tree)
            finally:
                trees.put(tree)
            console.print(f"{mutant.id}: {verdict}", highlight=False)
            return verdict

        return list(pool.map(work, mutants))


def main() -> int:
    """Judge the selected mutants and print a table of the verdicts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="stems of files in test/mutants, or ids")
    parser.add_argument("--jobs", type=int, default=2, help="copies that are tested at the same time")
    arguments = parser.parse_args()
    console = Console(width=160)
    mutants = load(arguments.names)
    verdicts = judge_all(mutants, arguments.jobs, console)
    table = Table("id", "verdict", "file", "noticed by", "what goes wrong")
    for mutant, verdict in zip(mutants, verdicts, strict=True):
        table.add_row(mutant.id, verdict, mutant.file, mutant.test.partition("::")[0], mutant.why)
    console.print(table)
    killed = verdicts.count("killed")
    console.print(f"{killed} of {len(mutants)} killed")
    return 0 if mutants and killed == len(mutants) else 1


if __name__ == "__main__":
    sys.exit(main())
