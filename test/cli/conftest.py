from pathlib import Path

import pytest
from reaching import Reach, reach_of


@pytest.fixture
def reach(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Reach:
    """Call verbs up to a function, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return reach_of(monkeypatch)
