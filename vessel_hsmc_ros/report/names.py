"""Labels of runs that are shown together: what distinguishes them."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.report.record import Record
from vessel_hsmc_ros.report.tables import value_text
from vessel_hsmc_ros.scenario.parameters import NODES

SHOWN = 2
"""Differing parameters that a label names; the table of parameters has all of them."""


def distinguished(records: Sequence[Record]) -> list[Record]:
    """Label runs by what differs between them: scenario, else law, else both, else parameters, else a number.

    Args:
        records: The runs, named by their scenarios.

    Returns:
        The records with unique names; a single one keeps its name.
    """
    names = [record.name for record in records]
    if len(records) < 2:
        return list(records)
    candidates = [names]
    if all(record.scenario for record in records):
        laws = [record.scenario.controller.law for record in records if record.scenario]
        candidates += [laws, [f"{name}, {law}" for name, law in zip(names, laws, strict=True)], _by_parameters(records)]
    # The first kind of label that is unique for every run.
    chosen = next((candidate for candidate in candidates if len(set(candidate)) == len(records)), None)
    return [replace(record, name=name) for record, name in zip(records, chosen or _numbered(candidates[-1], names), strict=True)]


def _by_parameters(records: Sequence[Record]) -> list[str]:
    """The parameters that differ, such as `sway_weight = 0.002`."""
    flat = [_parameters(record) for record in records]
    differing = [name for name in flat[0] if any(values[name] != flat[0][name] for values in flat)]
    labels = []
    for values in flat:
        texts = dict.fromkeys(f"{name.rsplit('.', 1)[-1]} = {value_text(values[name])}" for name in differing)
        more = ", …" if len(texts) > SHOWN else ""
        labels.append(", ".join(list(texts)[:SHOWN]) + more)
    return labels


def _parameters(record: Record) -> dict[str, Any]:
    """The parameters that affect a run: without those of the recorder and the folder of the black box."""
    nodes = [node for node in NODES if node != "recorder"]
    flat = {f"{n}.{name}": value for n in nodes for name, value in schema.flatten(getattr(record.scenario, n)).items()}
    return {name: value for name, value in flat.items() if name != "controller.black_box.directory"}


def _numbered(labels: Sequence[str], names: Sequence[str]) -> list[str]:
    """Labels, or names where a label is empty, with numbers where they are the same."""
    labels = [label or name for label, name in zip(labels, names, strict=True)]
    count = Counter(labels)
    return [f"{label} {i + 1}" if count[label] > 1 else label for i, label in enumerate(labels)]
