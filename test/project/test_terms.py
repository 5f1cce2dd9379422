"""The list of terms matches complete words and parts of names only."""

import pytest
from project import terms


def words(line: str, path: str = "README.md") -> list[str]:
    return [occurrence.word for occurrence in terms.occurrences(path, line)]


@pytest.mark.parametrize("line", ["it lists the key figures", "as_nobody = 1", "Nobody reads it", "the same bits in every run"])
def test_private_words_are_found_in_prose_and_in_names(line: str) -> None:
    assert words(line) != []


@pytest.mark.parametrize("line", ["the bold task", "essays", "the pushbutton", "swinger", "bit-identical"])
def test_parts_of_longer_words_are_not_found(line: str) -> None:
    assert words(line) == []


def test_constants_without_a_noun_are_found_and_words_like_them_are_not() -> None:
    assert words("if len(rows) > MOST:") == ["MOST"]
    assert words("of most rows; MOST_FORCE, AT_MOST, at MOST_") == []


def test_an_occurrence_names_its_place_and_the_standard_term() -> None:
    (found,) = terms.occurrences("docs/live.md", "first\nthe weather\n")
    assert str(found) == "docs/live.md:2: weather -> environmental loads, disturbance; wind, waves and current"


def test_exceptions_are_limited_to_their_files() -> None:
    assert words("# the weather of the ship", "msg_defs/msg/ControlState.msg") == []
    assert words("# the weather of the ship", "docs/live.md") == ["weather"]
