"""Mission files that are written and read."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros.boats.missions.files import read_mission
from vessel_hsmc_ros.boats.missions.mission import Mission

Read = Callable[..., Mission]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def of(text: str | bytes, name: str = "mission", **options: Any) -> Mission:
        file = tmp_path / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_mission(file, **options)

    return of
