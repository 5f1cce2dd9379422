"""What holds for every reference: its mirror image, and a reset that leaves nothing of what was before."""

from typing import Any

import numpy as np
import pytest
from durations import rest_long
from golden.part_references import CORNERS, LIMITED, MOTION, program
from golden.part_tools import PERIOD, built

from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference

MIRROR = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
START: dict[str, Any] = {"initial_pose": (3.0, 1.0, 0.4), "initial_velocity": (0.9, -0.05, 0.03)}
GOALS = [(25, (20.0, 7.0, 2.5)), (200, (16.0, 9.5, -2.0)), (500, (16.0, 9.5, 0.7)), (800, (-5.0, -9.0, 3.0))]
STREAM = [(5 * k, (4.0 + 0.5 * k, 6.0 + 0.02 * k * k, 0.3 + 0.02 * k)) for k in range(2, 60)]
PATHS = [(120, [(30.0, -20.0), (60.0, -10.0)]), (310, [(0.0, -30.0)])]


def reference_of(mode: str, **values: Any) -> Any:
    own = {**MOTION, **LIMITED} if mode in ("goal", "path", "lawnmower") else {}
    return make_reference(built(ReferenceShipParameters, mode=mode, **own, **values), PERIOD)


def rows(reference: Any, steps: int, events: Any = ()) -> Any:
    """State and acceleration of each step; events are goals or paths by the number of their step."""
    found, due = [], dict(events)
    for k in range(steps):
        if k in due:
            given = due[k]
            reference.set_path(given) if isinstance(given, list) else reference.set_goal(*given)
        found.append([*reference.state, *reference.acceleration()])
        reference.advance()
    return np.array(found)


def mirrored(given: Any) -> Any:
    """A goal or a path on the other side of the x axis."""
    return [(x, -y) for x, y in given] if isinstance(given, list) else (given[0], -given[1], -given[2])


@pytest.mark.parametrize(
    ("mode", "events", "speed"),
    rest_long([("goal", GOALS, 0.9), ("goal", STREAM, -0.4), ("path", PATHS[:1], 0.9), ("path", PATHS, -0.5)], 2),
)
def test_goals_and_paths_on_the_other_side_give_the_mirror_image(mode: str, events: Any, speed: float) -> None:
    x, y, psi = 3.0, 1.0, 0.4
    pair = [
        rows(
            reference_of(mode, initial_pose=(x, side * y, side * psi), initial_velocity=(speed, -0.05 * side, 0.03 * side)),
            1000 if mode == "goal" else 400,
            [(k, mirrored(given) if side < 0.0 else given) for k, given in events],
        )
        for side in (1.0, -1.0)
    ]
    np.testing.assert_allclose(pair[1] * MIRROR, pair[0], atol=1e-5)


CASES: list[tuple[str, dict[str, Any], Any]] = [
    ("virtual_ship", {**program("surge_force", 8e4, 0.1), **program("yaw_moment", 1.5e6, 0.3)}, ()),
    ("course", {f"course__{name}": value for name, value in program("heading", 1.1, 0.2).items()}, ()),
    ("goal", {"goal__poses": (15.0, 9.0, 2.5, -5.0, 1.0, 0.0), "goal__times": (0.5, 20.0)}, [*GOALS[:2], *STREAM[50:]]),
    ("path", {"path__time": 4.0, **CORNERS}, PATHS[1:]),
    ("circle", {"circle__radius": -40.0}, ()),
    ("square", {}, ()),
    ("straight", {}, ()),
    ("figure_eight", {}, ()),
    ("lawnmower", {"lawnmower__leg_length": 50.0, "lawnmower__spacing": 50.0, "lawnmower__speed": 1.0, "lawnmower__legs": 2}, ()),
]


@pytest.mark.parametrize(("mode", "values", "events"), rest_long(CASES, 3), ids=[case[0] for case in CASES])
def test_a_reference_that_was_reset_is_bit_identical_to_a_new_one(mode: str, values: dict[str, Any], events: Any) -> None:
    used, new = (reference_of(mode, **START, **values) for _ in range(2))
    rows(used, 333, events)
    if mode == "virtual_ship":
        used.retune(
            built(
                ReferenceShipParameters,
                **{**START, **values, "surge_force_sine__frequency": 0.9, "yaw_moment_sine__frequency": 0.7},
            )
        )
        rows(used, 20)
        used.retune(built(ReferenceShipParameters, **START, **values))
    for _ in range(2):
        used.reset()
        new.reset()
        np.testing.assert_array_equal(rows(used, 250), rows(new, 250))
        if hasattr(new, "track"):
            assert used.track == new.track or [one[2:] for one in used.track.stretches] == [
                one[2:] for one in new.track.stretches
            ]
