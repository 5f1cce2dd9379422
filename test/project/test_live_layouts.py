"""The layouts for Foxglove, PlotJuggler and RViz name topics and fields that exist."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import bag_making
import pytest
import yaml

from vessel_hsmc_ros.bags.topic_columns import MessageDecoder
from vessel_hsmc_ros.messages.topics import WATCHED_TOPICS, definition

LAYOUTS = Path(__file__).resolve().parents[2] / "config" / "live"


def fields(topic: str) -> tuple[str, ...]:
    kind = bag_making.TYPES[topic]
    return MessageDecoder(kind, kind, definition(kind)).fields


def foxglove_paths() -> list[Any]:
    layout = json.loads((LAYOUTS / "foxglove.json").read_text())
    values = [path["value"] for panel in layout["configById"].values() for path in panel.get("paths", ())]
    return [tuple(value[1:].split(".", 1)) for value in values]


def plotjuggler_curves() -> list[Any]:
    names = [str(curve.get("name"))[1:] for curve in ElementTree.parse(LAYOUTS / "plotjuggler.xml").iter("curve")]  # noqa: S314
    return [
        max((curve_of(name, topic) for topic in bag_making.TYPES if name.startswith(f"{topic}/")), key=known) for name in names
    ]


def curve_of(name: str, topic: str) -> tuple[str, str]:
    return topic, name.removeprefix(f"{topic}/").replace("/", ".")


def known(curve: tuple[str, str]) -> bool:
    """Whether the topic has the field: `reference/pose` is a topic, and also a field of `reference`."""
    topic, field = curve
    return field in fields(topic)


@pytest.mark.parametrize("curves", [foxglove_paths, plotjuggler_curves])
def test_every_curve_is_a_field_of_a_recorded_topic(curves: Callable[[], list[Any]]) -> None:
    assert len(curves()) > 10
    assert [curve for curve in curves() if not known(curve)] == []


def test_every_panel_of_the_foxglove_layout_is_placed() -> None:
    layout = json.loads((LAYOUTS / "foxglove.json").read_text())
    placed = re.findall(r'"((?:Plot|3D)![^"]*)"', json.dumps(layout["layout"]))
    assert sorted(placed) == sorted(layout["configById"])
    assert {topic[1:] for topic in layout["configById"]["3D!sea"]["topics"]} <= set(WATCHED_TOPICS)


def test_rviz_displays_the_topics_of_the_marker_node() -> None:
    manager = yaml.safe_load((LAYOUTS / "vessel_hsmc.rviz").read_text())["Visualization Manager"]
    topics = {display["Topic"]["Value"] for display in manager["Displays"] if "Topic" in display}
    assert topics == {"markers", "ship/path", "reference/path"}
    assert manager["Global Options"]["Fixed Frame"] == "odom"
