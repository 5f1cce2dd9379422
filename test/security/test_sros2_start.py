"""Where security is demanded and cannot be had, a node does not start: one clear line, exit code 2."""

import sys
from pathlib import Path

import pytest
from harness import Command

from vessel_hsmc_ros.nodes.ros_environment import ENABLE, KEYSTORE, start_error

ENFORCED = {ENABLE: "true", "ROS_SECURITY_STRATEGY": "Enforce"}
CODE = 2


def started(folder: Path, environment: dict[str, str]) -> tuple[int, str]:
    command = Command([sys.executable, "-m", "vessel_hsmc_ros.nodes", "controller"], folder, environment)
    return command.wait(60.0), command.text


def test_enforcement_without_a_keystore_is_refused_in_one_line(tmp_path: Path) -> None:
    code, text = started(tmp_path, ENFORCED)
    assert code == CODE
    assert f"cannot start: {ENABLE} is true, but {KEYSTORE} is not set" in text
    assert "Traceback" not in text


def test_enforcement_by_a_fast_dds_without_security_is_refused_in_one_line(tmp_path: Path) -> None:
    keystore = tmp_path / "keystore"
    (keystore / "enclaves").mkdir(parents=True)
    code, text = started(tmp_path, {**ENFORCED, KEYSTORE: str(keystore)})
    assert code == CODE
    assert f"{ENABLE} is true, but" in text  # built without security, or the keystore has no keys of this enclave
    assert "Traceback" not in text


def test_without_security_an_error_keeps_its_own_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(ENABLE, raising=False)
    assert start_error(RuntimeError("no\nmemory")) == "no memory"
