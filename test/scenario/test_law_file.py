"""Control laws in Python files: what is registered, what is refused, and that no scenario names code to import."""

import hashlib
import pickle
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros import load_scenario, make_controller
from vessel_hsmc_ros.control.laws import Registry
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.law_file import (
    is_present,
    law_file_options,
    law_provenance,
    load_law_file,
    load_named_files,
)
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.scenario import dump_scenario, make_law, parse_scenario

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "my_law.py"
TEXT = EXAMPLE.read_text(encoding="utf-8")
SCENARIO = "/**/controller: {ros__parameters: {law: my_law, my_law: {lookahead: 9}}}"
HEAD = """
from dataclasses import dataclass
from vessel_hsmc_ros import Law, Terms, parameter
@dataclass(frozen=True)
class P:
    gain: float = parameter(1.0, "A gain.")
"""
LAW = """
class {0}(Law[P]):
    name = "{1}"
    def step(self, motion, desired, acceleration):
        return (0.0, 0.0), Terms()
"""


pytestmark = pytest.mark.usefixtures("laws")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my_law.py"
    shutil.copy(EXAMPLE, path)
    return path


def test_a_file_registers_its_laws_without_a_trace_in_its_folder(file: Path, laws: Registry) -> None:
    assert load_law_file(file) == ("my_law",)
    assert laws["my_law"].origin == (str(file), hashlib.sha256(file.read_bytes()).hexdigest())
    assert list(file.parent.iterdir()) == [file]
    assert make_controller("my_law", 0.01, lookahead=3.0).name == "my_law"


def test_a_file_that_is_read_again_replaces_its_laws(file: Path, laws: Registry) -> None:
    load_law_file(file)
    file.write_text(TEXT.replace("parameter(12.0", "parameter(11.0"), encoding="utf-8")
    load_law_file(file)
    assert parse_scenario(SCENARIO.replace("lookahead: 9", ""), "s").controller.my_law.lookahead == 11.0  # type: ignore[attr-defined]


def test_a_scenario_alone_names_no_code(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(file.parent)  # where a file of the law's name lies
    with pytest.raises(ParameterError, match=r"controller\.law must be .*\(got my_law\).* needs --law-file FILE\.py"):
        parse_scenario(SCENARIO, "s")


def test_the_parameters_of_a_law_are_those_of_the_controller(file: Path) -> None:
    load_law_file(file)
    scenario = parse_scenario(SCENARIO, "s", {"controller.my_law.yaw_bandwidth": 0.5})
    law: Any = make_law(scenario.controller)
    assert (law.parameters.lookahead, law.parameters.yaw_bandwidth) == (9.0, 0.5)
    assert "my_law:\n      lookahead: 9.0" in dump_scenario(scenario)
    entries = schema.entries(NODES["controller"])
    assert entries["my_law.lookahead"].allowed == "a finite number from 0.1 to 1000 m"
    assert entries["law"].choices[-1] == "my_law"
    assert [name for name in entries if name.startswith("my_law.")] == list(entries)[-4:]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("my_law.lookahed", 3.0, "controller.my_law.lookahed is not a parameter: did you mean my_law.lookahead?"),
        (
            "my_law.lookahead",
            -3.0,
            "controller.my_law.lookahead must be a finite number from 0.1 to 1000 m",
        ),
    ],
)
def test_a_wrong_parameter_of_a_law_is_refused_as_every_other(file: Path, name: str, value: float, message: str) -> None:
    load_law_file(file)
    with pytest.raises(ParameterError, match=re.escape(message)):
        load_scenario("case2_tracking", {"controller.law": "my_law", f"controller.{name}": value})


def test_a_scenario_with_a_law_of_a_file_can_be_pickled(file: Path) -> None:
    load_law_file(file)
    scenario = parse_scenario(SCENARIO, "s")
    assert pickle.loads(pickle.dumps(scenario)) == scenario  # noqa: S301 - our own


def test_file_and_hash_are_recorded_with_a_run_and_recognised_by_content(file: Path) -> None:
    load_law_file(file)
    provenance = law_provenance("my_law")
    assert provenance == {"law_source": str(file), "law_sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    assert law_provenance("guided") == {}
    source = parse_scenario(SCENARIO, "s").with_bag(Path("bag"), Path("p")).recorder.law_source
    assert source == " ".join(provenance.values())
    assert is_present(source.replace(str(file), "/elsewhere/my_law.py"))
    assert not is_present(f"{file} {'0' * 64}")


def test_a_node_reads_the_files_of_its_options_and_returns_its_other_arguments(file: Path, laws: Registry) -> None:
    assert load_named_files(["--help"]) == ["--help"]
    assert not laws.others
    assert load_named_files([f"--law-file={file}"]) == []
    assert law_file_options() == ["--law-file", str(file)]
    assert load_named_files([*law_file_options(), "other"]) == ["other"]
    assert list(laws.others) == ["my_law"]
    with pytest.raises(ParameterError, match="--law-file must be a Python file"):
        load_named_files(["--law-file"])


WRONG = {
    "has no law: it needs a subclass": "x = 1\n",
    ":2: SyntaxError: invalid syntax": "x = 1\nclass = 3\n",
    ":3: ZeroDivisionError: division by zero": "\ndef f():\n    return 1 / 0\nf()\n",
    ":1: ModuleNotFoundError: No module named 'not_anywhere'": "import not_anywhere\n",
    ":2: SystemExit: 3": "import sys\nsys.exit(3)\n",
    "has no name: it needs a line such as": HEAD + LAW.format("A", ""),
    "is not a subclass of vessel_hsmc_ros.Law": "class A:\n    def step(self): ...\n",
    "law a lacks the method step": HEAD + 'class A(Law[P]):\n    name = "a"\n',
    "the name a is used by another law": HEAD + LAW.format("A", "a") + LAW.format("B", "a"),
    "the name guided is used by a law of vessel_hsmc_ros": HEAD + LAW.format("A", "guided"),
    "a.gain is not declared": HEAD.replace('parameter(1.0, "A gain.")', "1.0") + LAW.format("A", "a"),
    "SyntaxError: source code string cannot contain null bytes|ValueError: source code string": "x = '\0'\n",
}


@pytest.mark.parametrize(("reason", "code"), WRONG.items(), ids=range(len(WRONG)))
def test_a_wrong_file_is_refused_in_one_line_with_its_path_and_the_reason(
    tmp_path: Path, laws: Registry, reason: str, code: str
) -> None:
    path = tmp_path / "wrong.py"
    path.write_text(code)
    with pytest.raises(ParameterError, match=f"^law file {re.escape(str(path))}.*({reason})") as error:
        load_law_file(path)
    assert "\n" not in str(error.value)
    assert not laws.others


@pytest.mark.parametrize(("name", "reason"), [("missing.py", "No such file or directory"), ("", "Is a directory")])
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(ParameterError, match=f"law file .* cannot be read: {reason}"):
        load_law_file(tmp_path / name)


def test_a_law_whose_construction_fails_is_refused_with_file_and_line(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text(HEAD + LAW.format("A", "a") + "    def reset(self):\n        self.missing()\n")
    load_law_file(path)
    with pytest.raises(ParameterError, match=rf"law a failed at {path}:\d+: AttributeError: "):
        load_scenario("case2_tracking", {"controller.law": "a"})
