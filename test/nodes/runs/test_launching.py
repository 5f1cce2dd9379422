"""The launch files refuse what is wrong without raising: launch would lose sight of the processes that it has started."""

import importlib.util
import re
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

WHERE_TO_RUN = "comes with a ROS install only: source it, colcon build, and run this again"
launch = pytest.importorskip("launch", reason=f"launch {WHERE_TO_RUN}")
pytest.importorskip("launch_ros", reason=f"launch_ros {WHERE_TO_RUN}")

from vessel_hsmc_ros.core.exceptions import ParameterError, RunError  # noqa: E402
from vessel_hsmc_ros.core.install_paths import share_directory  # noqa: E402
from vessel_hsmc_ros.nodes.runs import launching  # noqa: E402


def launch_file(name: str) -> ModuleType:
    """A launch file as a module."""
    spec = importlib.util.spec_from_file_location(name, share_directory() / "launch" / f"{name}.launch.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FILES = {name: launch_file(name) for name in ("closed_loop", "controller")}

TEXTS = st.one_of(
    st.text(max_size=20), st.sampled_from(["true", "FALSE", "case2_tracking", "guided", "a/b", "/", "//", "~", "/dev/null", "1"])
)


def context_of(**arguments: str) -> Any:
    context = launch.LaunchContext()
    context.launch_configurations.update(arguments)
    return context


@pytest.mark.parametrize("name", FILES)
@given(data=st.data())
def test_no_text_of_an_argument_lets_a_launch_file_raise(name: str, data: st.DataObject) -> None:
    module = FILES[name]
    declared = [entity for entity in module.generate_launch_description().entities if hasattr(entity, "default_value")]
    arguments = {entity.name: entity.default_value[0].text if entity.default_value else "" for entity in declared}
    arguments |= {
        each: data.draw(TEXTS, each) for each in data.draw(st.lists(st.sampled_from([*arguments]), unique=True, min_size=1))
    }
    arguments["output"] = "/dev/null"  # nothing is written: what is right until then is refused here
    if Path(arguments.get("params_file", "")).is_file():
        return
    try:
        actions = module.start_nodes(context_of(**arguments))
    finally:
        getattr(module, "HELD", ExitStack()).close()  # other tests of this process use the domain
    assert [type(action).__name__ for action in actions] == ["RegisterEventHandler", "EmitEvent"]


def test_any_exception_becomes_a_failure_with_its_reason() -> None:
    for error, text in (
        (ParameterError("x must be 1 (got 2)"), "x must be 1 (got 2)"),
        (ModuleNotFoundError("no", name="numpy"), "numpy is not installed"),
        (OSError("the disk"), "unexpected OSError: the disk"),
    ):

        def failing(error: Exception = error) -> list[Any]:
            raise error

        context = context_of()
        for action in launching.never_raising(failing)():
            action.execute(context)
        event = context._event_queue.get_nowait()
        (handler,) = (each for each in context._event_handlers if each.matches(event))
        (action,) = handler.entities
        with pytest.raises(RunError, match=re.escape(text)):
            action.execute(context)


@pytest.mark.parametrize("text", ["true", "True", "TRUE", "tRuE"])
def test_a_flag_may_have_capital_letters(text: str) -> None:
    assert launching.flag(context_of(flag=text), "flag")
    assert not launching.flag(context_of(flag="False"), "flag")


@pytest.mark.parametrize("text", ["", "yes", "1", "truely", " true"])
def test_a_flag_is_nothing_else(text: str) -> None:
    with pytest.raises(ParameterError, match="flag must be true or false"):
        launching.flag(context_of(flag=text), "flag")


@pytest.mark.parametrize(
    ("pushed", "given_name", "expected"),
    [(None, "", "/"), (None, "a", "/a"), (None, "/a/", "/a"), ("/f", "", "/f"), ("/f", "a/b", "/f/a/b"), ("/f", "/a", "/a")],
)
def test_the_namespace_is_below_what_has_been_pushed(pushed: str | None, given_name: str, expected: str) -> None:
    context = context_of(namespace=given_name, **({"ros_namespace": pushed} if pushed else {}))
    assert launching.namespace_of(context) == expected
