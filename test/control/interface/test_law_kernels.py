"""The kernels of the laws: bit-identical whether interpreted or compiled, and their holders keep to the interface of a law."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long

from vessel_hsmc_ros.control.interface.law import KernelLaw, Terms, guarded_step
from vessel_hsmc_ros.control.laws import LAWS, make_controller
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.control.laws.manoeuvre import KINDS
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.simulation.compilation import compiled

if TYPE_CHECKING:
    from vessel_hsmc_ros.control.interface.law import Law

PERIOD = 0.01
STEPS = 40
KERNEL_LAWS = [name for name in LAWS if name != "nmpc"]
LISTED: dict[str, Any] = {"network.layout": "listed", "network.listed_centers": [0.5, 0.0, 0.1, -0.4, 0.2, 0.0]}
NETWORKS: list[dict[str, Any]] = [{}, LISTED, {"network.basis": "as_printed"}, {"network.centers_per_axis": 4}]
SWITCHING: list[dict[str, Any]] = [{"switching": "saturation"}, {"switching": "tanh"}]
SETTINGS: dict[str, list[dict[str, Any]]] = {
    "hierarchical": NETWORKS,
    "hierarchical_printed": [
        *NETWORKS,
        *SWITCHING,
        {"adaptation": "as_printed"},
        {"sway_weight_sign": "switched", "sway_weight": 0.5},
    ],
    "course": [*NETWORKS, *SWITCHING],
    "pd": [{}],
    "los_pid": [{}, {"surge_force_limit": 5e3}, {"guidance": "alos"}],
    "ashrafiuon": [{}, {"surfaces": "as_printed"}, {"surge_force_limit": 5e3}],
    "backstepping": [{}, {"surge_force_limit": 5e3}],
    "hand_position": [{}, {"surge_force_limit": 5e3}],
    "manoeuvre": [{"kind": kind, "approach_time": 0.1, "hold_time": 0.02, "steps": 3} for kind in KINDS],
    "open_loop": [{"times": (0.0, 0.1, 0.2), "surge_force": (1.0, 2.0, 3.0), "yaw_moment": (4.0, 5.0, 6.0)}],
}
FIRST = ("los_pid", "pd")
ORDERED = sorted(KERNEL_LAWS, key=lambda name: name not in FIRST)
CASES = [(name, settings) for name in ORDERED if name != "guided" for settings in SETTINGS[name]]
"""Those after the first laws are long, as their kernels are compiled for this test alone. Without the guided law, whose kernel
takes longest to compile: test/simulation/test_compiled_loop.py compares the loops of all laws bit by bit, which are compiled for
other tests too."""


def series(seed: int) -> list[tuple[Motion, Motion, Acceleration]]:
    """Random walks of ship and reference near and far from each other, at rest and at speed, with headings across 180 degrees."""
    random = np.random.default_rng(seed)
    start = random.uniform(-1.0, 1.0, 12) * [60.0, 60.0, 4.0, 3.0, 1.0, 0.5, 60.0, 60.0, 4.0, 3.0, 1.0, 0.5]
    start[6:] *= random.choice([0.0, 1e-3, 1.0])
    walk = start + np.cumsum(random.normal(size=(STEPS, 12)) * random.choice([0.0, 1e-3, 0.1]), axis=0)
    rates = random.uniform(-0.2, 0.2, (STEPS, 3))
    return [
        (Motion(*row[:6]), Motion(*row[6:]), Acceleration(*rate)) for row, rate in zip(walk.tolist(), rates.tolist(), strict=True)
    ]


def history(law: Any, step: Callable[..., Any], inputs: list[tuple[Motion, Motion, Acceleration]]) -> list[Any]:
    """Wrench, terms and memory of each step."""
    law.reset()
    memory, seen = law.memory, []
    for k, (motion, desired, acceleration) in enumerate(inputs):
        age = (PERIOD * (k % 5),) if law.takes_age else ()
        wrench, terms, memory = step(motion, desired, acceleration, memory, law.constants, *age)
        # Compiled, products are added without being written to the scratch, whose content means nothing between steps.
        kept = tuple(part for field, part in zip(memory._fields, memory, strict=True) if field != "scratch")
        seen.append(np.concatenate([np.ravel(part) for part in (wrench, terms, *flat(kept))]))
    return seen


def flat(value: Any) -> list[Any]:
    return [leaf for part in value for leaf in flat(part)] if isinstance(value, tuple) else [value]


@only_compiled
@pytest.mark.parametrize(
    ("name", "settings"),
    rest_long(CASES, sum(name in FIRST for name, _ in CASES)),
    ids=lambda value: value if isinstance(value, str) else "-".join(map(str, value)),
)
def test_interpreted_and_compiled_kernels_are_bit_identical(name: str, settings: dict[str, Any]) -> None:
    law: Any = make_controller(name, PERIOD, **settings)
    # All settings of a law have the same types, so each law is compiled once.
    fast = compiled(type(law).kernel, allocates=False)
    for seed in range(6):
        inputs = series(seed)
        np.testing.assert_array_equal(history(law, fast, inputs), history(law, type(law).kernel, inputs))


@pytest.mark.parametrize("name", KERNEL_LAWS)
def test_the_holder_returns_what_the_kernel_returns(name: str) -> None:
    law, twin = (make_controller(name, PERIOD) for _ in range(2))
    assert isinstance(law, KernelLaw)
    assert isinstance(twin, KernelLaw)
    memory = twin.memory
    for inputs in series(1):
        wrench, terms = law.step(*inputs)
        expected, floats, memory = twin.kernel(*inputs, memory, twin.constants)
        assert wrench == expected
        for field, value in floats._asdict().items():
            assert getattr(terms, field) == value
        for row, network in enumerate(law.networks):
            np.testing.assert_array_equal(getattr(terms, f"{network}_weights"), memory.W[row])
        assert [type(value) for value in terms] == [type(value) for value in Terms()]
        absent = set(Terms._fields) - {*floats._fields, *(f"{network}_weights" for network in law.networks)}
        np.testing.assert_equal([getattr(terms, field) for field in absent], [Terms._field_defaults[field] for field in absent])


@pytest.mark.parametrize("name", ["hierarchical_printed", "course"])
def test_the_weights_among_the_terms_are_copies(name: str) -> None:
    law = make_controller(name, PERIOD)
    inputs = series(1)
    kept = [law.step(*each)[1].yaw_weights for each in inputs]
    law.reset()
    for each, weights in zip(inputs, kept, strict=True):
        np.testing.assert_array_equal(weights, law.step(*each)[1].yaw_weights)
    assert kept[-1].any()


def test_a_wrench_that_overflows_is_reported_although_the_law_is_defined_there() -> None:
    law = make_controller("hierarchical_printed", PERIOD)
    fast = 1e200
    with pytest.raises(ControlError, match="must be finite numbers"):
        guarded_step(law, Motion(0.0, 0.0, 0.0, fast, fast, fast), Motion(*[0.0] * 6), Acceleration(0.0, 0.0, 0.0))


def test_a_step_at_the_singularity_leaves_the_memory_of_the_law_as_it_was() -> None:
    law, twin = (make_controller("hierarchical_printed", PERIOD) for _ in range(2))
    still, reference = Acceleration(0.0, 0.0, 0.0), Motion(*[0.0] * 6)
    near = Motion(1.0, 2.0, 0.3, 1.0, 0.1, 0.05)
    for each in (law, twin):
        each.step(near, reference, still)
    with pytest.raises(ControlError, match="singular"):
        law.step(near._replace(x=1e5, y=0.0, psi=0.0), reference, still)
    after, expected = law.step(near, reference, still), twin.step(near, reference, still)
    assert after[0] == expected[0]
    np.testing.assert_array_equal(after[1].yaw_weights, expected[1].yaw_weights)


def test_a_variant_of_a_kernel_law_is_a_subclass_that_may_call_its_step() -> None:
    class Halved(LAWS["hierarchical_printed"].controller):  # type: ignore[name-defined, misc]
        name = "halved"

        def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> Any:
            (tau_1, tau_2), terms = super().step(motion, desired, acceleration)
            return (0.5 * tau_1, tau_2), terms

    law: Law[Any] = Halved(HierarchicalPrintedParameters(), make_controller("hierarchical_printed", PERIOD).vessel, PERIOD)
    inputs = series(2)[0]
    assert law.step(*inputs)[0][0] == 0.5 * make_controller("hierarchical_printed", PERIOD).step(*inputs)[0][0]
    assert math.isfinite(law.step(*inputs)[0][1])


def test_a_variant_of_a_law_that_takes_the_age_may_define_a_step_without_it() -> None:
    class Plain(LAWS["guided"].controller):  # type: ignore[name-defined, misc]
        name = "plain"

        def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> Any:
            return super().step(motion, desired, acceleration)

    base = make_controller("guided", PERIOD)
    law: Law[Any] = Plain(LAWS["guided"].parameters(), base.vessel, PERIOD)
    assert base.takes_age
    assert not law.takes_age
    inputs = series(2)[0]
    assert guarded_step(law, *inputs, age=0.5)[0] == base.step(*inputs)[0]
