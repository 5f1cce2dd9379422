"""The known bugs of test/mutants fit the present source, and drawn ones are valid source; `make mutants` applies both."""

import ast
import functools
from pathlib import Path

from mutants.operators import changes
from mutants.run import load

ROOT = Path(__file__).resolve().parents[2]
MUTANTS = load()


def test_the_ids_of_the_known_bugs_differ() -> None:
    ids = [mutant.id for mutant in MUTANTS]
    assert sorted(set(ids)) == sorted(ids)


def test_each_known_bug_changes_a_text_that_occurs_once_and_names_a_test() -> None:
    read = functools.cache(lambda file: (ROOT / file).read_text(encoding="utf-8"))
    named = {mutant.id: mutant.test.split("[")[0].split("::") for mutant in MUTANTS}
    assert not [mutant.id for mutant in MUTANTS if read(mutant.file).count(mutant.find) != 1]
    assert not [mutant.id for mutant in MUTANTS if mutant.find == mutant.replace]
    assert not [each for each, (file, name) in named.items() if f"def {name}(" not in read(file)]


SOURCE = """
def limited(value: float = -1.0) -> float:
    \"\"\"A text with 2 numbers.\"\"\"
    log(value, "µ", 3)
    return min(value + 2.0, 5) if value >= 0 and not done else f"{value + 1}"
"""


def test_drawn_bugs_change_one_place_each_and_leave_texts_as_they_are() -> None:
    drawn = [change.applied(SOURCE) for change in changes(SOURCE, range(6))]
    assert len(set(drawn)) == len(drawn)
    trees = [ast.unparse(ast.parse(source)) for source in drawn]
    assert ast.unparse(ast.parse(SOURCE)) not in trees
    made = "\n".join(trees)
    for part in ("value > 0", "value - 2.0", "or not done", "min(5, value + 2.0)", "and done", "float=1.0)", "6)", "    pass"):
        assert part in made, part
    assert all("A text with 2 numbers." in tree and "{value + 1}" in tree for tree in trees)


def test_only_the_lines_that_changed_are_drawn_from() -> None:
    assert {change.line for change in changes(SOURCE, {4})} == {4}
    assert changes(SOURCE, ()) == []
