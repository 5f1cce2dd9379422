import math
from dataclasses import FrozenInstanceError, dataclass, replace

import numpy as np
import pytest

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import group, parameter


@dataclass(frozen=True)
class Inner:
    gain: float = parameter(2.0, "A gain.", unit="1/s", low=0.0, high=10.0, symbol="k")


@dataclass(frozen=True)
class Outer:
    rate_hz: float = parameter(100.0, "A rate.", unit="Hz", low=1.0, high=1000.0, symbol="f")
    name: str = parameter("a", "A choice.", choices=("a", "b"))
    count: int = parameter(3, "A count.", low=1, high=9)
    flag: bool = parameter(False, "A flag.")
    pose: tuple[float, ...] = parameter((0.0, 0.0, 0.0), "Three numbers.", low=-5.0, high=5.0, length=3)
    topics: tuple[str, ...] = parameter(("x",), "Names.")
    limit: float = parameter(math.inf, "No limit.", low=0.0, high=math.inf)
    inner: Inner = group(Inner)


def test_defaults_and_nested_values() -> None:
    assert schema.build(Outer, {}, "node") == Outer()
    built = schema.build(Outer, {"rate_hz": 50, "inner.gain": 3.0, "pose": [1, 2.0, 3], "topics": ["y", "z"]}, "node")
    assert built == Outer(rate_hz=50.0, inner=Inner(3.0), pose=(1.0, 2.0, 3.0), topics=("y", "z"))
    assert isinstance(built.rate_hz, float)


def test_numpy_numbers_are_accepted() -> None:
    built = schema.build(Outer, {"rate_hz": np.float64(50.0), "count": np.int64(4), "pose": np.arange(3.0)}, "node")
    assert built == Outer(rate_hz=50.0, count=4, pose=(0.0, 1.0, 2.0))
    assert [type(value) for value in (built.rate_hz, built.count, *built.pose)] == [float, int, float, float, float]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("rate_hz", 0.5, r"node\.rate_hz must be a finite number from 1 to 1000 Hz.*got 0\.5"),
        ("rate_hz", math.nan, r"node\.rate_hz must be .*from 1 to 1000 Hz.*\(got nan\)"),
        ("rate_hz", "fast", r"node\.rate_hz must be .*finite number.*\(got 'fast'\)"),
        ("rate_hz", True, r"node\.rate_hz must be .*finite number.*\(got True\)"),
        ("inner.gain", 11.0, r"node\.inner\.gain must be .*from 0 to 10 1/s.*\(got 11\.0\)"),
        ("name", "c", r"node\.name must be .*one of a, b.*\(got c\)"),
        ("count", 2.5, r"node\.count must be .*an integer from 1 to 9.*\(got 2\.5\)"),
        ("count", 10, r"node\.count must be .*from 1 to 9.*\(got 10\)"),
        ("flag", 1, r"node\.flag must be .*true or false.*\(got 1\)"),
        ("pose", [1.0, 2.0], r"node\.pose must be .*list of 3 finite numbers.*\(got \[1\.0, 2\.0\]\)"),
        ("pose", [1.0, 2.0, 6.0], r"node\.pose .* from -5 to 5"),
        ("pose", "abc", r"node\.pose must be .*list of 3.*\(got 'abc'\)"),
        ("pose", 3.0, r"node\.pose must be .*list of 3.*\(got 3\.0\)"),
        ("topics", [1], r"node\.topics must be .*list of strings.*\(got \[1\]\)"),
        ("topics", {"a": 1}, r"node\.topics must be .*list of strings.*\(got \{'a': 1\}\)"),
        ("ratehz", 1.0, r"node\.ratehz is not a parameter: did you mean rate_hz\?"),
        ("zzzzzz", 1.0, r"node\.zzzzzz is not a parameter: allowed are rate_hz, name"),
    ],
)
def test_an_error_names_the_value_and_the_allowed_ones(name, value, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        schema.build(Outer, {name: value}, "node")


def test_infinity_only_where_it_is_allowed() -> None:
    assert schema.build(Outer, {"limit": math.inf}, "node").limit == math.inf
    with pytest.raises(ParameterError):
        schema.build(Outer, {"limit": math.nan}, "node")
    with pytest.raises(ParameterError):
        schema.build(Outer, {"rate_hz": math.inf}, "node")


def test_flatten_is_the_inverse_of_build() -> None:
    changed = Outer(rate_hz=20.0, inner=Inner(1.0))
    assert schema.build(Outer, schema.flatten(changed), "node") == changed


def test_symbols_of_one_level() -> None:
    assert schema.symbols(Outer()) == {"f": 100.0}
    assert schema.symbols(Inner()) == {"k": 2.0}


def test_instances_are_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        Outer().rate_hz = 1.0  # type: ignore[misc]


@dataclass(frozen=True)
class Deep:
    value: float = parameter(1.0, "A value.", unit="m", low=-2.0, high=3.0, symbol="v", remedy="less")
    kind: str = parameter("new", "A kind.", choices=("new", "other"))
    many: tuple[float, ...] = parameter((1.0, 2.0), "Two.", low=0.0, high=9.0, length=2, tunable=True)


@dataclass(frozen=True)
class Middle:
    deep: Deep = group(Deep)
    live: Deep = group(Deep, tunable=True)


@dataclass(frozen=True)
class Top:
    middle: Middle = group(Middle)
    all_live: Middle = group(Middle, tunable=True)


@pytest.mark.parametrize("path", ["middle.deep", "middle.live", "all_live.deep", "all_live.live"])
def test_a_declaration_is_the_same_in_every_group_but_for_its_name_and_whether_it_may_change_at_run_time(path: str) -> None:
    own, nested = schema.entries(Deep), schema.entries(Top)
    live = "live" in path
    for name, entry in own.items():
        assert nested[f"{path}.{name}"] == replace(entry, name=f"{path}.{name}", tunable=live or entry.tunable)


@pytest.mark.parametrize("path", ["middle.deep", "middle.live", "all_live.deep", "all_live.live"])
def test_a_change_by_a_dotted_name_changes_that_value_alone(path: str) -> None:
    before = schema.flatten(Top())
    for name, value in (("value", 2.5), ("kind", "other"), ("many", (3.0, 4.0))):
        assert schema.flatten(schema.build(Top, {f"{path}.{name}": value}, "node")) == {**before, f"{path}.{name}": value}


@pytest.mark.parametrize("length", [0, 1, 3])
def test_a_list_is_neither_shorter_nor_longer_than_declared(length: int) -> None:
    with pytest.raises(ParameterError, match=r"node\.many must be a list of 2 finite numbers.*got \[.*\]"):
        schema.build(Deep, {"many": [1.0] * length}, "node")


def test_the_limits_themselves_are_allowed_and_the_remedy_ends_the_error() -> None:
    for value in (-2.0, 3.0):
        assert schema.build(Deep, {"value": value}, "node").value == value
        with pytest.raises(ParameterError, match=r"must be a finite number from -2 to 3 m \(got .*\); less$"):
            schema.build(Deep, {"value": value * 1.001}, "node")
