"""What the figures of a report draw: data, colours, limits, marks, units."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Picture
from matplotlib.patches import Rectangle
from matplotlib.quiver import Quiver
from numpy.typing import NDArray
from records import make_run

from vessel_hsmc_ros.report import Record, diagrams, figures
from vessel_hsmc_ros.report.diagrams import Figure
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


def drawn(found: Overlay, alone: bool = True, marks: tuple[Mark, ...] = ()) -> Figure:
    return figures.of_panel(found, alone, marks)


def named(figure: Figure) -> list[str]:
    return [trace["name"] for trace in figure["traces"] if trace["name"]]


def pictured(figures_: list[Figure], path: Path, monkeypatch: pytest.MonkeyPatch, **look: Any) -> Picture:
    """The picture of some figures, as matplotlib has it."""
    kept: list[Picture] = []
    monkeypatch.setattr(Picture, "savefig", lambda picture, _: kept.append(picture))
    diagrams.draw(path / "a.png", figures_, **look)
    return kept[0]


def test_the_track_goes_from_a_dot_to_a_square_with_the_heading_as_arrows() -> None:
    run = moving("one").run
    figure = figures.track([moving("one")])
    assert named(figure) == ["reference", "ship"]
    assert [trace["marker"]["color"] for trace in figure["traces"]] == [*["--reference"] * 3, *["--ship"] * 4]
    assert [trace["line"]["dash"] for trace in figure["traces"] if trace["mode"] == "lines"] == ["6px,4px", "solid"]
    for first, poses in ((0, run.reference), (3, run.state)):
        line, start, end = figure["traces"][first : first + 3]
        np.testing.assert_allclose([line["x"], line["y"]], poses[:, :2].T, rtol=1e-3)
        assert (start["marker"]["symbol"], end["marker"]["symbol"]) == ("circle", "square")
        np.testing.assert_allclose([*start["x"], *start["y"], *end["x"], *end["y"]], [*poses[0, :2], *poses[-1, :2]], rtol=1e-3)
    arrows = figure["traces"][-1]
    assert len(arrows["x"]) == 11
    headings = np.interp(arrows["y"], run.state[:, 1], run.state[:, 2])
    np.testing.assert_allclose(arrows["marker"]["angle"], 90.0 - np.degrees(headings), rtol=1e-4)
    assert figure["layout"]["yaxis"]["scaleanchor"] == "x"


def test_tracks_of_several_runs_have_the_colours_of_their_runs() -> None:
    figure = figures.track([moving("one"), moving("two", 5.0)])
    found = {trace["name"]: trace["line"]["color"] for trace in figure["traces"] if trace["name"]}
    assert found == {"reference": "--shared", "two": "--run-1", "one": "--run-0"}


def test_a_track_far_from_the_origin_is_as_fine_as_one_near_it() -> None:
    near, far = moving("near"), moving("far", 5e6)
    x, shifted = (np.array(figures.track([each])["traces"][3]["x"]) for each in (near, far))
    np.testing.assert_allclose(shifted - 5e6, x, atol=1e-3)
    assert diagrams.numbers(np.array([5e6, 5e6 + 1.23456, np.nan])) == [5e6, 5e6 + 1.2346, None]
    assert diagrams.numbers(np.array([1.23456789, 100.0])) == [1.2346, 100.0]


def test_values_and_limits_are_drawn_in_the_unit_of_the_axis() -> None:
    values = -5e4 * np.sin(TIME) - 1e5
    limits = Limit(2e5, "law"), Limit(3e5, "actuator"), Limit(9e5, "far")
    figure = drawn(panel_of(Line("force", TIME, values), limits=limits, step=True))
    assert figure["layout"]["yaxis"]["title"]["text"] == "a title [kN]"
    (trace,) = figure["traces"]
    np.testing.assert_allclose(trace["y"], 1e-3 * values, rtol=1e-4)
    assert trace["line"]["shape"] == "hv"
    shapes = figure["layout"]["shapes"]
    assert [shape["y0"] for shape in shapes] == [-200.0, 200.0, -300.0, 300.0]  # the third is too far away
    assert [shape["name"] for shape in shapes] == ["", "limit: law", "", "limit: actuator"]
    assert {shape["line"]["color"] for shape in shapes} == {"--limit"}


def test_the_lower_end_of_the_values_counts_for_their_unit_too() -> None:
    figure = drawn(panel_of(Line("force", TIME, np.linspace(-5e3, 10.0, len(TIME)))))
    assert figure["layout"]["yaxis"]["title"]["text"].endswith("[kN]")
    assert figure["traces"][0]["line"]["shape"] == "linear"


@pytest.mark.parametrize(("peak", "shown"), [(7e6, "peak 7 MN, beyond the scale"), (-7e6, "peak -7 MN, beyond the scale")])
def test_a_short_peak_to_either_side_is_named_and_does_not_flatten_the_line(peak: float, shown: str) -> None:
    values = 1e4 * np.sin(TIME)
    values[3] = peak
    layout = drawn(panel_of(Line("force", TIME, values)))["layout"]
    assert [note["text"].replace("−", "-") for note in layout["annotations"]] == [shown]
    assert max(map(abs, layout["yaxis"]["range"])) < 30.0
    assert not drawn(panel_of(Line("force", TIME, 1e4 * np.sin(TIME))))["layout"]["annotations"]


def test_a_line_has_the_colour_of_its_role_in_one_run_and_of_its_run_in_several() -> None:
    lines = [Line(role, TIME, TIME, role) for role in ("main", "desired", "other", "third", "measured")]
    alone, several = (drawn(panel_of(*lines), each)["traces"] for each in (True, False))
    assert [trace["line"]["color"] for trace in alone] == ["--ship", "--reference", "--other", "--third", "--shared"]
    assert [trace["line"]["color"] for trace in several] == [f"--run-{run}" for run in range(5)]
    assert len({trace["line"]["dash"] for trace in alone[:4]}) == 4
    assert [diagrams.page_colour(diagrams.run_colour(run)) for run in (None, 0, 7)] == [
        diagrams.NEUTRAL,
        diagrams.SERIES[0],
        diagrams.SERIES[1],
    ]


def test_events_are_marked_in_the_panels_of_a_single_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    marks = Mark(2.5, "pause", ""), Mark(7.5, "resume", "")
    shapes = drawn(panel_of(Line("a", TIME, TIME)), marks=marks)["layout"]["shapes"]
    assert [(shape["x0"], shape["yref"]) for shape in shapes] == [(2.5, "paper"), (7.5, "paper")]
    given: list[list[Figure]] = []
    monkeypatch.setattr(diagrams, "draw", lambda _path, found, *_, **look: given.append(found) if "stacked" in look else None)
    one, two = replace(moving("one"), marks=marks), moving("two", 5.0)
    figures.draw([one], tmp_path)
    assert {len(figure["layout"]["shapes"]) for group in given for figure in group} == {2}
    assert [figure["title"] for figure in given[0]] == ["Errors", "", ""]
    given.clear()
    figures.draw([one, two], tmp_path)
    assert {len(figure["layout"]["shapes"]) for group in given for figure in group} == {0}


def test_a_picture_shows_lines_limits_and_arrows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    overlay = panel_of(Line("a", TIME, TIME), Line("b", TIME, -TIME, "desired"), limits=(Limit(40.0, "law"),), step=True)
    picture = pictured([drawn(overlay)] * 2, tmp_path, monkeypatch, stacked=True)
    for axes in picture.axes:
        assert [to_hex(line.get_color()) for line in axes.lines] == [diagrams.SHIP, diagrams.REFERENCE, *[diagrams.LIMIT] * 2]
        assert [line.get_drawstyle() for line in axes.lines[:2]] == ["steps-post"] * 2
        np.testing.assert_allclose(np.array(axes.lines[1].get_data()), [TIME, -TIME], atol=1e-3)
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == ["a", "b", "limit: law"]
    assert [axes.get_xlabel() for axes in picture.axes] == ["", "time [s]"]
    (axes,) = pictured([figures.track([moving("one")])], tmp_path, monkeypatch).axes
    (arrows,) = (each for each in axes.collections if isinstance(each, Quiver))
    headings = np.interp(np.asarray(arrows.XY)[:, 1], moving("one").run.state[:, 1], moving("one").run.state[:, 2])
    np.testing.assert_allclose(np.array([arrows.U, arrows.V], float), [np.cos(headings), np.sin(headings)], atol=1e-3)


def test_late_steps_are_above_and_early_ones_below_the_period(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times = np.concatenate([[0.0], np.cumsum(np.where(np.arange(200) == 50, 0.13, np.where(np.arange(200) == 90, 0.06, 0.1)))])
    control = {"time": times, "compute_time": 0.0 * times}
    late = Record("late", replace(moving("late").run, control=control))
    (figure,) = figures.jitter([late, moving("even")])
    assert figure["title"].replace("−", "-") == "late: smallest -40 ms, largest +30 ms"
    assert figure["layout"]["xaxis"]["title"]["text"] == "control interval minus 0.1 s [ms]"
    (bars,) = figure["traces"]
    assert sum(bars["y"]) == 200
    (axes,) = pictured([figure], tmp_path, monkeypatch).axes
    assert [bar.get_height() for bar in axes.patches if isinstance(bar, Rectangle)] == bars["y"]
    assert axes.get_yscale() == "log"
