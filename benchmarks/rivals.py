"""Laws tuned with the same budget, and judged on runs and draws that the searches have not seen: see docs/tuning.md.

Every law has the same number of trials on the 16 runs of the suite `tuning`, with the same seed. Each gain is searched on a
logarithmic scale, and the first trial is the middle of all ranges, so that no law begins with gains that somebody has found. The
result is judged on the 22 cases of the suite `guided` and on ships drawn by a campaign: `hull_uncertainty` with instant
actuators, `drawn_ships` with slow ones. With `--slow` both inputs have a lag of 1 s, 5 s from zero to full and 0.3 s of dead time
on the suites as well, all of it declared. For comparison the gains of the package have a row each, with no trial.

    python benchmarks/rivals.py [--slow] [--laws los_pid,guided] [--trials 100] [--draws 128] [--output runs/rivals]
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vessel_hsmc_ros.control.interface import known_vessel
from vessel_hsmc_ros.studies.campaign.plan import Campaign
from vessel_hsmc_ros.studies.tuning.plan import Case, Evaluation, Gain, Objective, Tuning, load_cases, parse_gains
from vessel_hsmc_ros.studies.tuning.result import tune

LOS_PID = {
    "lookahead_time": (1.0, 30.0),
    "lookahead_distance": (2.0, 60.0),
    "along_gain": (0.05, 3.0),
    "catch_up_speed": (0.5, 10.0),
    "surge_gain": (0.1, 10.0),
    "surge_integral_gain": (0.01, 3.0),
    "yaw_bandwidth": (0.1, 3.0),
    "yaw_damping": (0.5, 2.0),
    "yaw_integral_gain": (0.001, 0.3),
    "command_bandwidth": (0.2, 10.0),
    "capture_radius": (0.05, 5.0),
}

ASHRAFIUON = {
    "sway_slope": (0.06, 6.0),
    "surge_gain": (0.1, 10.0),
    "sway_gain": (0.05, 5.0),
    "surge_boundary": (0.005, 0.5),
    "sway_boundary": (0.005, 0.5),
    "least_control_gain": (0.1, 1.0),
}

RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "los_pid": {**LOS_PID, "integral_gain": (0.05, 5.0)},
    "los_pid, ALOS": {**LOS_PID, "adaptation_gain": (1e-4, 0.02)},
    "ashrafiuon": {**ASHRAFIUON, "position_gain": (0.03, 3.0), "position_scale": (0.3, 100.0)},
    "ashrafiuon, as printed": {**ASHRAFIUON, "surge_slope": (0.01, 1.0)},
    "backstepping": {
        "along_gain": (0.05, 5.0),
        "along_scale": (1.0, 100.0),
        "heading_gain": (0.05, 5.0),
        "surge_gain": (0.1, 10.0),
        "yaw_gain": (0.2, 10.0),
        "speed_weight": (0.01, 0.3),
        "excitation": (0.01, 0.9),
        "excitation_frequency": (0.02, 2.0),
        "error_scale": (1.0, 30.0),
        "filter_time": (0.03, 1.0),
    },
    "hand_position": {
        "hand_distance": (0.1, 10.0),
        "position_gain": (0.03, 3.0),
        "velocity_gain": (0.1, 10.0),
        "integral_gain": (0.003, 0.5),
        "largest_error": (1.0, 100.0),
    },
    "guided": {
        "cross_track": (0.008, 0.3),
        "turn_rate": (0.08, 2.0),
        "position_gain": (0.3, 8.0),
        "approach_speed": (0.1, 2.0),
        "approach_braking": (0.02, 0.4),
        "integral_gain": (0.02, 1.0),
        "surge_gain": (0.8, 20.0),
        "approach_angle": (0.07, 1.5),
        "turn_share": (0.05, 1.0),
        "velocity_noise": (0.001, 0.05),
        "yaw_rate_noise": (0.002, 0.05),
        "surge_walk": (0.03, 1.0),
        "sway_walk": (0.001, 0.03),
        "yaw_walk": (0.03, 1.0),
    },
}
"""The searched gains of each law with their ranges."""

OPTIONS: dict[str, dict[str, object]] = {
    "los_pid, ALOS": {"controller.los_pid.guidance": "alos"},
    "ashrafiuon, as printed": {"controller.ashrafiuon.surfaces": "as_printed"},
}

INSTANT: dict[str, object] = {f"controller.vessel.{name}": value for name, value in known_vessel.INSTANT.items()}
SLOW: dict[str, object] = {
    f"{owner}.{name}": value
    for owner in ("vessel_sim.actuators", "controller.vessel")
    for name, value in (
        ("surge_lag", 1.0),
        ("yaw_lag", 1.0),
        ("surge_force_rate", 4e4),
        ("yaw_moment_rate", 6e5),
        ("surge_dead_time", 0.3),
        ("yaw_dead_time", 0.3),
    )
}

PEAK = "position_error_peak_last_quarter"

LOST, WITHIN = 10.0, {True: 0.5, False: 0.1}
"""Rms error of the last quarter from which a ship counts as lost; limit of the largest error of drawn ships, slow or not, m."""

HEAD = ("law", "gains", "trials", "cost on tuning", "cost on guided", "limits met", "lost", "draws beyond", "median of draws [m]")


def unseen(slow: bool, draws: int) -> list[Case]:
    """The draws of the campaign for instant or slow actuators."""
    campaign = Campaign.load("drawn_ships" if slow else "hull_uncertainty", draws)
    runs = range(0, campaign.runs, len(campaign.laws))
    return [Case(f"draw {run}", campaign.scenario(run), {PEAK: WITHIN[slow]}) for run in runs]


def with_law(cases: Sequence[Case], changes: Mapping[str, object]) -> list[Case]:
    """The cases with other parameters of their controllers."""
    return [replace(case, scenario=case.scenario.changed(changes)) for case in cases]


def unstretched(law: str) -> dict[str, object]:
    """The change by which searched gains of los_pid hold as they are, also for slow actuators."""
    return {"controller.los_pid.stretch": 1.0} if law == "los_pid" else {}


def search(name: str, conditions: Mapping[str, object], trials: int, folder: Path) -> Mapping[str, float]:
    """Search the gains of a law.

    Args:
        name: The law and its option, a key of RANGES.
        conditions: Changes of all runs.
        trials: Their number.
        folder: Where they are recorded; a search there is continued.
    """
    law = name.partition(",")[0]
    changes = {**conditions, **OPTIONS.get(name, {}), **unstretched(law)}
    texts = [f"controller.{law}.{gain}={low}:{high}:log" for gain, (low, high) in RANGES[name].items()]
    gains: list[Gain] = parse_gains(texts, law, load_cases("tuning", changes, law)[0].scenario)
    cases = load_cases("tuning", {**changes, **{gain.parameter: gain.at(0.5) for gain in gains}}, law)
    tuning = Tuning(cases, gains, Objective())
    folder.mkdir(parents=True, exist_ok=True)
    found = tune(tuning, folder, trials, cases[:1], lambda *_: None)
    return found.best.gains


def row(name: str, gains: Mapping[str, float], trials: int, seen: Sequence[Case], judges: Sequence[Sequence[Case]]) -> list[str]:
    """A row of the table.

    Args:
        name: The law and its option.
        gains: Its gains; none for those of the package.
        trials: How many the search took.
        seen: The runs of the search.
        judges: The cases of the suite `guided`, and the drawn ships.
    """
    law = name.partition(",")[0]
    changes = {"controller.law": law, **OPTIONS.get(name, {}), **gains, **(unstretched(law) if gains else {})}
    tuning = Tuning(with_law(seen, changes), [Gain("", 0.0, 1.0, False)], Objective())
    on_tuning, on_suite = (tuning.evaluate(with_law(cases, changes), {}) for cases in (seen, judges[0]))
    drawn = Tuning(seen, tuning.gains, Objective(metric=PEAK)).evaluate(with_law(judges[1], changes), {})
    met = int(np.sum(ratios(on_suite) <= 1.0))
    lost = int(np.sum(~(on_suite.values[:, 0] < LOST)))
    beyond = int(np.sum(~(ratios(drawn) <= 1.0)))
    errors = np.where(np.isnan(drawn.values[:, 0]), np.inf, drawn.values[:, 0])
    return [
        name,
        str(len(RANGES[name])) if trials else "package",
        str(trials),
        *(f"{each.cost.cost:.3g}" for each in (on_tuning, on_suite)),
        f"{met} of {len(judges[0])}",
        str(lost),
        f"{beyond} of {len(judges[1])}",
        f"{np.median(errors):.2g}",
    ]


def ratios(evaluation: Evaluation) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The errors relative to their limits, (n,); NaN for a run that failed."""
    return np.asarray(evaluation.values[:, 0] / evaluation.scales[:, 0])


def main() -> None:
    """Search the gains of each law and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--slow", action="store_true", help="lag, rate and dead time in both inputs")
    parser.add_argument("--laws", help="laws, separated by semicolons (default: all)")
    parser.add_argument("--trials", type=int, default=100, help="number of trials for each law")
    parser.add_argument("--draws", type=int, default=128, help="number of drawn ships")
    parser.add_argument("--output", type=Path, default=Path("runs/rivals"), help="folder of the searches")
    given = parser.parse_args()
    conditions = SLOW if given.slow else INSTANT
    judges = load_cases("guided", conditions), unseen(given.slow, given.draws)
    seen = load_cases("tuning", conditions)
    print("| " + " | ".join(HEAD) + " |\n|" + " --- |" * len(HEAD), flush=True)
    for name in given.laws.split(";") if given.laws else RANGES:
        print("| " + " | ".join(row(name, {}, 0, seen, judges)) + " |", flush=True)
        gains = search(name, conditions, given.trials, given.output / f"{name.replace(', ', '_')}{'_slow' * given.slow}")
        print("| " + " | ".join(row(name, gains, given.trials, seen, judges)) + " |", flush=True)


if __name__ == "__main__":
    main()
