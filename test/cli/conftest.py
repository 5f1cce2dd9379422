from pathlib import Path

import pytest
from reaching import Reach, reacher


@pytest.fixture
def reach(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Reach:
    """Call verbs up to a function, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return reacher(monkeypatch)
