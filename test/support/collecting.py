"""How pytest collects test modules where the plugin of launch_testing is installed."""

from collections.abc import Generator
from pathlib import Path

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> Generator[None, object, object]:
    """Let a module that skips itself be skipped alone.

    The plugin imports each module of a folder while pytest lists them, and from version 8 on a skip there skips the whole folder.
    """
    try:
        return (yield)
    except pytest.skip.Exception:
        return pytest.Module.from_parent(parent, path=module_path)
