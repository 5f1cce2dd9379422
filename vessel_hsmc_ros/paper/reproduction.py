"""The whole reproduction: run every case, measure, draw, judge, write down."""

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.paper.case_run import Outcome, nodes_folder, run_by_nodes
from vessel_hsmc_ros.paper.cases import CASES, Case
from vessel_hsmc_ros.paper.checks import Results
from vessel_hsmc_ros.paper.claims_proof import CLAIMS
from vessel_hsmc_ros.paper.errata import FINDINGS
from vessel_hsmc_ros.paper.numbers import Numbers
from vessel_hsmc_ros.paper.parallel import durations, run_all
from vessel_hsmc_ros.paper.tables import claims_page
from vessel_hsmc_ros.runs import scenario_run

Watch = Callable[[float], None]


def run_cases(cases: Sequence[Case], nodes: Path | None, watch: Watch) -> dict[str, Outcome]:
    """Run cases, those that nodes can run by the nodes if there is a folder for their bags.

    Args:
        cases: Which.
        nodes: Folder of the nodes' run folders; None runs everything in processes of its own, offline.
        watch: Called with the simulated time of all cases together, s.

    Raises:
        RunError: ROS is not installed, or a run did not end as it should.
        SimulationError, ControlError: a case ended early that should not have.
    """
    by_nodes = [case for case in cases if nodes is not None and case.by_nodes]
    offline = [case for case in cases if case not in by_nodes]
    outcomes = run_all(offline, watch) if offline else {}
    done = sum(durations(offline))
    for case, duration in zip(by_nodes, durations(by_nodes), strict=True):
        begun = done
        assert nodes is not None  # noqa: S101 - no case is run by nodes without
        with scenario_run.place_for_nodes(""):
            outcomes[case.name] = run_by_nodes(case, nodes_folder(nodes, case), lambda time, begun=begun: watch(begun + time))  # type: ignore[misc]
        done += duration
    return {case.name: outcomes[case.name] for case in cases}


def write(outcomes: Mapping[str, Outcome], folder: Path, cases: Sequence[Case] = CASES) -> Results:
    """Write results.json, claims.md and figures/ into a folder; returns the numbers.

    Raises:
        RunError: the folder cannot be written.
    """
    from vessel_hsmc_ros.paper.figures import draw_all  # matplotlib is slow to load

    results = {name: outcome.numbers for name, outcome in outcomes.items()}
    try:
        figures = folder / "figures"
        figures.mkdir(parents=True, exist_ok=True)
        (folder / "results.json").write_text(dump(results, cases), encoding="utf-8")
        (folder / "claims.md").write_text(claims_page(results), encoding="utf-8")
        draw_all(outcomes, figures)
    except OSError as error:
        raise RunError(f"results cannot be written into {folder}: {error.strerror}") from None
    return results


def dump(results: Results, cases: Sequence[Case] = CASES) -> str:
    """All numbers as JSON; what does not exist is left out, so two equal runs give equal bytes."""
    described: dict[str, Any] = {}
    for case in cases:
        numbers = dataclasses.asdict(results[case.name])
        described[case.name] = {
            "words": case.words,
            "scenario": case.scenario,
            "changes": dict(case.changes),
            "numbers": {name: value for name, value in numbers.items() if not math.isnan(value)},
        }
    document = {
        "cases": described,
        "claims": [
            {"place": c.place, "claim": c.words, "measured": c.measured(results), "holds": c.holds(results)} for c in CLAIMS
        ],
        "findings": [
            {"words": f.words, "prototype": f.theirs, "here": _finite(f.ours(results)), "alike": f.alike(results)}
            for f in FINDINGS
        ],
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def load(path: Path) -> dict[str, Numbers]:
    """The numbers of a results.json.

    Raises:
        RunError: the file cannot be read.
    """
    try:
        cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
        return {name: Numbers(**case["numbers"]) for name, case in cases.items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"results {path} cannot be read: {error}") from None


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value
