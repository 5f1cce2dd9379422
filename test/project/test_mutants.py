"""The known bugs of test/mutants fit the present source; `make mutants` applies them."""

from pathlib import Path

import pytest
from mutants.run import Mutant, load

ROOT = Path(__file__).resolve().parents[2]
MUTANTS = load()


def test_the_ids_of_the_known_bugs_differ() -> None:
    ids = [mutant.id for mutant in MUTANTS]
    assert sorted(set(ids)) == sorted(ids)


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.id)
def test_a_known_bug_changes_a_text_that_occurs_once_and_names_a_test(mutant: Mutant) -> None:
    text = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert text.count(mutant.find) == 1
    assert mutant.find != mutant.replace
    file, name = mutant.test.split("::")
    assert f"def {name.split('[')[0]}(" in (ROOT / file).read_text(encoding="utf-8")
