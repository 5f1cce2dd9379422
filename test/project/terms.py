"""List the words of `terms.yaml` that occur in the repository's own text, with the standard term for each.

    python test/project/terms.py [FOLDER]

The exit code is 1 if there are any.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import yaml

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
TEXT = (
    ".cff",
    ".cmake",
    ".css",
    ".html",
    ".in",
    ".js",
    ".json",
    ".md",
    ".mjs",
    ".msg",
    ".py",
    ".rst",
    ".toml",
    ".txt",
    ".xml",
    ".yaml",
    ".yml",
)
TERMS = yaml.safe_load((HERE / "terms.yaml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Occurrence:
    """A word that has a standard term, at its place."""

    path: str
    line: int
    word: str
    write: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.word} -> {self.write}"


# Letters alone delimit a word, so that the parts of a snake_case name are words too.
PATTERNS = [
    (re.compile(rf"(?<![a-z])(?:{term['find']})(?![a-z])", 0 if term.get("exact") else re.IGNORECASE), term["write"])
    for term in TERMS["terms"]
]


def excepted(path: str, line: str) -> bool:
    """Whether a line is listed among the exceptions."""
    return any(fnmatch(path, entry["file"]) and entry["text"] in line for entry in TERMS["exceptions"])


def occurrences(path: str, text: str) -> Iterator[Occurrence]:
    """Find the words in one file."""
    for number, line in enumerate(text.splitlines(), start=1):
        for pattern, write in PATTERNS:
            for match in pattern.finditer(line):
                if not excepted(path, line):
                    yield Occurrence(path, number, match.group(), write)


def files(root: Path) -> list[str]:
    """The text files that are under version control, or would be after the next commit."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True
    )
    return [name for name in listed.stdout.splitlines() if name.endswith(TEXT) or Path(name).name == "Makefile"]


def main() -> int:
    """Print every occurrence."""
    found = [
        occurrence
        for name in files(ROOT)
        if (ROOT / name).is_file()
        for occurrence in occurrences(name, (ROOT / name).read_text(encoding="utf-8"))
    ]
    for occurrence in found:
        print(occurrence)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
