"""What the figures of a report draw: data, colours, limits, marks, units."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from numpy.typing import NDArray
from records import make_run

from vessel_hsmc_ros.report import Record, diagrams, figures
from vessel_hsmc_ros.report.panels import Line, Overlay, Owned, Panel
from vessel_hsmc_ros.report.record import Limit, Mark

Array = NDArray[Any]
TIME = np.arange(0.0, 30.0, 0.1)


def moving(name: str, side: float = 0.0, **known: Any) -> Record:
    """A ship that sails to the north and turns slowly, beside a reference of another shape."""
    zero = 0.0 * TIME
    state = np.column_stack([3.0 + side + zero, 1.0 + 2.0 * TIME, 0.5 + 0.05 * TIME, zero, zero, zero])
    reference = np.column_stack([1.0 - 0.5 * TIME, 4.0 + TIME, zero, zero, zero, zero])
    return Record(name, make_run(TIME, state, reference=reference, **known))


def panel_of(*lines: Line, unit: str = "N", limits: tuple[Limit, ...] = (), step: bool = False) -> Overlay:
    owned = tuple(Owned(line, line.name, run) for run, line in enumerate(lines))
    return Overlay(Panel("Group", "a title", unit, lines, limits, step), owned)


def drawn(*found: Overlay, alone: bool = True, marks: tuple[Mark, ...] = ()) -> list[Axes]:
    return figures.group("Group", found, alone, marks).axes


def data_of(axis: Axes, index: int) -> tuple[Array, Array]:
    x, y = axis.lines[index].get_data()
    return np.asarray(x), np.asarray(y)


def colours(axis: Axes) -> list[str]:
    return [to_hex(line.get_color()) for line in axis.lines]


def test_the_track_goes_from_a_dot_to_a_square_with_the_heading_as_arrows() -> None:
    run = moving("one").run
    (axis,) = figures.track([moving("one")]).axes
    assert colours(axis) == [*[diagrams.REFERENCE] * 3, *[diagrams.SHIP] * 3]
    for first, poses in ((0, run.reference), (3, run.state)):
        np.testing.assert_array_equal(data_of(axis, first), poses[:, :2].T)
        for index, marker, pose in ((first + 1, "o", poses[0]), (first + 2, "s", poses[-1])):
            assert axis.lines[index].get_marker() == marker
            assert np.ravel(data_of(axis, index)) == pytest.approx(pose[:2])
    assert [axis.lines[index].get_linestyle() for index in (0, 3)] == ["--", "-"]
    (arrows,) = (each for each in axis.collections if isinstance(each, Quiver))
    assert arrows.N == 11
    headings = np.interp(np.asarray(arrows.XY)[:, 1], run.state[:, 1], run.state[:, 2])
    np.testing.assert_allclose(np.array([arrows.U, arrows.V], float), [np.cos(headings), np.sin(headings)], atol=1e-9)
    legend = axis.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["ship", "reference"]


def test_tracks_of_several_runs_have_the_colours_of_their_runs() -> None:
    (axis,) = figures.track([moving("one"), moving("two", 5.0)]).axes
    found = {str(line.get_label()): to_hex(line.get_color()) for line in axis.lines if not str(line.get_label()).startswith("_")}
    assert found == {"reference": diagrams.NEUTRAL, "two": diagrams.SERIES[1], "one": diagrams.SERIES[0]}


def test_values_and_limits_are_drawn_in_the_unit_of_the_axis() -> None:
    values = -5e4 * np.sin(TIME) - 1e5
    limits = Limit(2e5, "law"), Limit(3e5, "actuator"), Limit(9e5, "far")
    (axis,) = drawn(panel_of(Line("force", TIME, values), limits=limits, step=True))
    assert axis.get_ylabel() == "a title\n[kN]"
    np.testing.assert_allclose(data_of(axis, 0), [TIME, 1e-3 * values])
    assert axis.lines[0].get_drawstyle() == "steps-post"
    bounds = [float(data_of(axis, index)[1][0]) for index in range(1, len(axis.lines))]
    assert bounds == [-200.0, 200.0, -300.0, 300.0]  # the third is too far away
    assert set(colours(axis)[1:]) == {diagrams.LIMIT}
    legend = axis.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["force", "limit: law", "limit: actuator"]


def test_the_lower_end_of_the_values_counts_for_their_unit_too() -> None:
    (axis,) = drawn(panel_of(Line("force", TIME, np.linspace(-5e3, 10.0, len(TIME)))))
    assert axis.get_ylabel().endswith("[kN]")
    assert axis.lines[0].get_drawstyle() == "default"


@pytest.mark.parametrize(("peak", "shown"), [(7e6, "peak 7 MN, beyond the scale"), (-7e6, "peak -7 MN, beyond the scale")])
def test_a_short_peak_to_either_side_is_named_and_does_not_flatten_the_line(peak: float, shown: str) -> None:
    values = 1e4 * np.sin(TIME)
    values[3] = peak
    (axis,) = drawn(panel_of(Line("force", TIME, values)))
    assert [text.get_text().replace("−", "-") for text in axis.texts] == [shown]
    assert max(map(abs, axis.get_ylim())) < 30.0
    (calm,) = drawn(panel_of(Line("force", TIME, 1e4 * np.sin(TIME))))
    assert not calm.texts


def test_a_line_has_the_colour_of_its_role_in_one_run_and_of_its_run_in_several() -> None:
    lines = [Line(role, TIME, TIME, role) for role in ("main", "desired", "other", "third", "measured")]
    (alone,) = drawn(panel_of(*lines))
    assert colours(alone) == [diagrams.SHIP, diagrams.REFERENCE, diagrams.OTHER, diagrams.THIRD, diagrams.NEUTRAL]
    assert [line.get_linestyle() for line in alone.lines] == ["-", "--", ":", "-.", "-"]
    (several,) = drawn(panel_of(*lines), alone=False)
    assert colours(several) == [*diagrams.SERIES[:5]]
    assert [diagrams.page_colour(diagrams.run_colour(run)) for run in (None, 0, 7)] == [
        diagrams.NEUTRAL,
        diagrams.SERIES[0],
        diagrams.SERIES[1],
    ]


def test_events_are_marked_in_every_panel_of_a_single_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    marks = Mark(2.5, "pause", ""), Mark(7.5, "resume", "")
    axes = drawn(panel_of(Line("a", TIME, TIME)), panel_of(Line("b", TIME, TIME)), marks=marks)
    assert [[float(data_of(axis, index)[0][0]) for index in (1, 2)] for axis in axes] == [[2.5, 7.5]] * 2
    assert [axis.get_xlabel() for axis in axes] == ["", "time [s]"]
    given: list[tuple[bool, Any]] = []
    monkeypatch.setattr(figures, "track", lambda _: Figure())

    def noted(_name: str, _found: Any, alone: bool, marks: Any) -> Figure:
        given.append((alone, tuple(marks)))
        return Figure()

    monkeypatch.setattr(figures, "group", noted)
    one, two = replace(moving("one"), marks=marks), moving("two", 5.0)
    figures.draw([one], tmp_path)
    assert set(given) == {(True, marks)}
    given.clear()
    figures.draw([one, two], tmp_path)
    assert set(given) == {(False, ())}


def test_late_steps_are_above_and_early_ones_below_the_period() -> None:
    times = np.concatenate([[0.0], np.cumsum(np.where(np.arange(200) == 50, 0.13, np.where(np.arange(200) == 90, 0.06, 0.1)))])
    control = {"time": times, "compute_time": 0.0 * times}
    late = Record("late", replace(moving("late").run, control=control))
    shown = figures.jitter_histogram([late, moving("even")])
    assert shown is not None
    (axis,) = shown.axes
    assert axis.get_title().replace("−", "-") == "late: smallest -40 ms, largest +30 ms"
    assert axis.get_xlabel() == "control interval minus 0.1 s [ms]"
