"""The reproduction of the paper: run every case, measure, draw the figures, test the claims, save the results."""

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.studies.paper.case_run import CaseResult, duration_of, make_case_folder, run_case_by_nodes, simulate_case
from vessel_hsmc_ros.studies.paper.cases import CASES, LAWS, Case, of_law
from vessel_hsmc_ros.studies.paper.claims import CLAIMS, FINDINGS, Claim, Results, claims_page
from vessel_hsmc_ros.studies.paper.numbers import Numbers
from vessel_hsmc_ros.studies.runs import scenario_run, worker_pool

Progress = Callable[[float], None]


def run_cases(cases: Sequence[Case], nodes: Path | None, progress: Progress) -> dict[str, CaseResult]:
    """Run cases in worker processes, or by the nodes where they can.

    `nodes`: folder for the run folders of the nodes; None runs every case offline. `progress`: called with the simulated time
    of all cases together. Returns the results by the name of the case, in the order of the cases. Raises RunError if ROS is not
    installed, or a node or worker process failed; SimulationError, ControlError if a case diverged that is not expected to.
    """
    by_nodes = [case for case in cases if nodes is not None and case.by_nodes]
    # The longest cases first, so that no long one is left to a single worker at the end.
    offline = sorted((case for case in cases if case not in by_nodes), key=duration_of, reverse=True)
    results = worker_pool.run_all(simulate_case, offline, on_progress=progress)
    by_name = {case.name: result for case, result in zip(offline, results, strict=True)}
    if nodes is not None:
        by_name |= _run_by_nodes(by_nodes, nodes, progress, sum(map(duration_of, offline)))
    return {case.name: by_name[case.name] for case in cases}


def _run_by_nodes(cases: Sequence[Case], parent: Path, progress: Progress, start: float) -> dict[str, CaseResult]:
    """Run cases by the nodes, one after the other; their progress counts from `start`."""
    results = {}
    for case in cases:

        def add_progress(time: float, start: float = start) -> None:
            progress(start + time)

        # Nodes of a concurrent run in the same namespace would mix their topics with these.
        with scenario_run.reserve_namespace(""):
            results[case.name] = run_case_by_nodes(case, make_case_folder(parent, case), add_progress)
        start += duration_of(case)
    return results


def write(results: Mapping[str, CaseResult], folder: Path, cases: Sequence[Case] = CASES) -> Results:
    """Write results.json, claims.md and the figures into a folder.

    `folder`: created if it does not exist. `cases`: the cases, in the order in which results.json lists them. Returns the
    numbers of every case, by name. Raises RunError if the folder cannot be written.
    """
    from vessel_hsmc_ros.studies.paper.figures import draw_all  # matplotlib is slow to import

    numbers = {name: result.numbers for name, result in results.items()}
    try:
        figures = folder / "figures"
        figures.mkdir(parents=True, exist_ok=True)
        (folder / "results.json").write_text(dump(numbers, cases), encoding="utf-8")
        (folder / "claims.md").write_text(claims_page(numbers), encoding="utf-8")
        draw_all(results, figures)
    except OSError as error:
        raise RunError(f"results cannot be written into {folder}: {error.strerror}") from None
    return numbers


def dump(results: Results, cases: Sequence[Case] = CASES) -> str:
    """All numbers as JSON text; NaN is left out, so that equal runs give equal bytes."""
    described: dict[str, Any] = {}
    for case in cases:
        numbers = dataclasses.asdict(results[case.name])
        described[case.name] = {
            "title": case.title,
            "scenario": case.scenario,
            "changes": {name: _finite(value) for name, value in case.changes.items()},
            **({"constants": dict(case.constants)} if case.constants else {}),
            "numbers": {name: value for name, value in numbers.items() if not math.isnan(value)},
        }
    document = {
        "cases": described,
        "claims": [
            {
                "place": claim.place,
                "claim": claim.statement,
                "required": claim.required,
                **{words: _outcome(claim, law, results) for law, words in LAWS.items()},
            }
            for claim in CLAIMS
        ],
        "findings": [
            {
                "quantity": f.quantity,
                "prototype": f.prototype,
                "here": _finite(f.measured(results)),
                "agrees": f.agrees(results),
            }
            for f in FINDINGS
        ],
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def load(path: Path) -> dict[str, Numbers]:
    """Read the numbers of a results.json. Raises RunError if the file cannot be read."""
    try:
        cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
        return {name: Numbers(**case["numbers"]) for name, case in cases.items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"results {path} cannot be read: {error}") from None


def _outcome(claim: Claim, law: str, results: Results) -> dict[str, Any]:
    own = of_law(law, results)
    return {"measured": claim.measured(own), "holds": claim.holds(own), "answer": claim.answer(own, law)}


def _finite(value: object) -> object:
    """A value that JSON can hold."""
    return value if not isinstance(value, float) or math.isfinite(value) else str(value)
