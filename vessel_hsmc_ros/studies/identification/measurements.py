"""Measurements from runs, bags and CSV files, checked before they are used, by the rules of `vessel-hsmc check` too.

The equations of motion take times, frames and signs for granted. Data that contradict them give wrong hull data, or a motion that
diverges, and no residual shows the cause.
"""

import csv
import io
import math
from array import array
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.run_from_bag import matched, measured_states, seconds_of, wrenches
from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.quantities import number_of
from vessel_hsmc_ros.preflight.clocks import clocks_differ, set_back, unusable
from vessel_hsmc_ros.preflight.connection import WRONG, Connection, Role, Topic
from vessel_hsmc_ros.preflight.motion_rules import judge_motion
from vessel_hsmc_ros.preflight.sign_rules import judge_signs
from vessel_hsmc_ros.studies.identification.types import Measurements, require_rate

FEWEST = 50  # samples that a run needs at least
CLOCK_OFFSET = 0.5
"""By how much odometry and wrench may be of unlike age at receipt, s: the default time-out of the controller's inputs."""
DIFFERING = 0.01  # share of messages with the stamp of another one and another motion up to which the first of them counts
LONGEST_GAP = 5.0  # largest interval between samples, in units of the median one
OTHERWISE = 0.25  # a force has reversed when it has come from this share of its range at one end to that at the other one
EXCITED_BY = {
    "surge_inertia": (0, "surge force", 2, "sail speed steps with coasting or astern in between"),
    "sway_inertia": (2, "yaw moment", 4, "sail zig-zags to both sides, at two speeds"),
    "yaw_inertia": (2, "yaw moment", 4, "sail zig-zags to both sides"),
}
"""The column of the wrench behind each inertia, its name, how many reversals separate the inertia from damping and from the
timing of the wrench, and what to sail."""


def checked(run: Measurements, window: float = 0.0) -> Measurements:
    """The run itself, if it can be used."""
    if len(run.time) < FEWEST:
        raise IdentificationError(f"{run.name} has {len(run.time)} samples: at least {FEWEST} are needed")
    for name, values in (("time", run.time), ("pose", run.pose), ("wrench", run.wrench)):
        bad = np.flatnonzero(~np.isfinite(values).reshape(len(run.time), -1).all(axis=1))
        if len(bad):
            raise IdentificationError(f"{run.name}: the {name} of sample {bad[0]} is not finite: remove or fill such samples")
    steps = np.diff(run.time)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0))
        raise IdentificationError(f"{run.name}: time goes from {run.time[at]:g} s to {run.time[at + 1]:g} s: it must increase")
    if steps.max() > LONGEST_GAP * np.median(steps):
        at = int(np.argmax(steps))
        raise IdentificationError(
            f"{run.name}: no sample for {steps[at]:.3g} s at t = {run.time[at]:g} s, but every {np.median(steps):.3g} s "
            "elsewhere: split the run there"
        )
    duration = float(run.time[-1] - run.time[0])
    if duration < window:
        raise IdentificationError(f"{run.name} lasts {duration:.1f} s: at least one window of {window:g} s is needed")
    require_rate(run, window)
    if not np.any(run.wrench):
        raise IdentificationError(f"{run.name} has no force or moment: the wrench on the hull must be recorded")
    return run


def reversals(force: Array) -> int:
    """How often a force goes from one end of its range to the other, (n,)."""
    low, high = float(force.min()), float(force.max())
    margin = OTHERWISE * (high - low)
    ends = np.select([force >= high - margin, force <= low + margin], [1, -1], 0) if high > low else np.zeros(0)
    return int(np.count_nonzero(np.diff(ends[ends != 0])))


def few_reversals(runs: Sequence[Measurements], names: Collection[str]) -> list[str]:
    """A sentence about each estimated inertia behind which there are too few reversals, and what to sail."""
    found = []
    for name, (column, force, needed, remedy) in EXCITED_BY.items():
        sway = name == "sway_inertia" and any(np.any(run.wrench[:, 1]) for run in runs)
        column, force = (1, "sway force") if sway else (column, force)
        count = sum(reversals(run.wrench[:, column]) for run in runs)
        if name in names and count < needed:
            times = "1 reversal" if count == 1 else f"{count} reversals"
            found.append(
                f"{name} rests on {times} of the {force}, where {needed} or more are needed: {remedy} (vessel-hsmc excite)"
            )
    return found


NEEDED = ("time", "x", "y")
HEADINGS = ("heading", "heading_deg")
VELOCITIES = ("u", "v", "r")
WRENCH = ("surge_force", "sway_force", "yaw_moment")
WRENCH_TOPICS = ("applied_wrench", "cmd_wrench")
MOST_NUMBERS = 1 << 24  # numbers in a table: two million rows of eight columns
LONGEST_LINE = 1 << 20  # characters of a row
HELD = 0.2  # share of unchanged positions from which on a sensor is taken to repeat its samples


def from_run(run: Run, name: str = "run") -> Measurements:
    """The measured motion and the applied wrench of a run. Raises IdentificationError if the samples do not serve."""
    wrench = run.wrench if run.wrench.shape[1] == len(WRENCH) else np.insert(run.wrench, 1, 0.0, axis=1)
    return _measurements(run.time, run.measured, wrench, name)


def from_bag(path: Path | str, namespace: str | None = None, odometry: str = "", wrench: str = "") -> Measurements:
    """Odometry with the applied wrench, or the commanded one where the bag has no other, at the odometry's stamps."""
    bag = open_bag(path, odometry, wrench)
    prefix = bag.namespace(namespace)
    state, force = bag.find(prefix, "odom"), _wrench_of(bag, prefix)
    if state is None:
        raise IdentificationError(f"bag {path} has no message on {prefix}odom that can be decoded")
    _require_stamps(bag, state, force)
    motion = measured_states(state, bag.twist_frame(prefix))
    stamps, order = np.unique(state.stamp, return_index=True)  # late odometry repeats its first measurement
    _require_one_motion(state, motion)
    index, found = matched(stamps, force)
    if not found.any():
        # Stamped by another clock rate: the latest wrench holds until the next.
        by_time = np.argsort(force.stamp, kind="stable")
        latest = np.searchsorted(force.stamp[by_time], stamps, side="right") - 1
        index, found = by_time[np.maximum(latest, 0)], latest >= 0
    if not found.any():
        raise IdentificationError(f"bag {path}: no wrench on {force.name} is as old as an odometry message")
    time = seconds_of(stamps - stamps[np.argmax(found)])
    rows = np.flatnonzero(found)
    return judged(_measurements(time[rows], motion[order][rows], wrenches(force)[index[rows]], str(path)))


def _wrench_of(bag: Bag, prefix: str) -> Series:
    for name in WRENCH_TOPICS:
        if (series := bag.find(prefix, name)) is not None:
            return series
    raise IdentificationError(
        f"bag {bag.path} has no wrench: {' or '.join(prefix + name for name in WRENCH_TOPICS)} or --wrench is needed"
    )


def _require_stamps(bag: Bag, *topics: Series) -> None:
    """Check that stamps are filled in, of clocks that have not been set, and of the same clock."""
    shown = [Topic(s.name, received=seconds_of(s.log_time), columns={"stamp": seconds_of(s.stamp)}) for s in topics]
    for series, topic in zip(topics, shown, strict=True):
        if reason := unusable(topic):
            raise IdentificationError(f"bag {bag.path}: {reason}")
        if twice := set_back(series.as_recorded(topic.columns["stamp"])):
            text = f"{twice:.3g} s are covered twice: was the clock set back, or a recording played again?"
            raise IdentificationError(f"bag {bag.path}: the stamps of {series.name} go back, {text}")
    if reason := clocks_differ(shown[0], shown[1], CLOCK_OFFSET):
        raise IdentificationError(f"bag {bag.path}: {reason}")


def _require_one_motion(odometry: Series, motion: Array) -> None:
    """Check that messages of one stamp have the same motion: repeated messages count once, and others have no time."""
    order = np.argsort(odometry.stamp, kind="stable")
    same = np.diff(odometry.stamp[order]) == 0
    differing = same & (np.diff(motion[order], axis=0) != 0.0).any(axis=1)
    if differing.mean() > DIFFERING:
        text = f"{int(differing.sum())} of {len(differing)} messages have the stamp of another one, but not its motion"
        raise IdentificationError(f"{odometry.name} repeats its stamps: {text}; its publisher must stamp each message")


def from_csv(path: Path | str, columns: Mapping[str, str] | None = None) -> Measurements:
    """A CSV file with columns for time, pose and wrench, and optionally for the velocities.

    The columns are time, x, y, heading or heading_deg; u, v, r where measured; surge_force, sway_force, yaw_moment, else zero.
    """
    table, named = _table(Path(path)), dict(columns or {})
    known = (*NEEDED, *HEADINGS, *VELOCITIES, *WRENCH)
    for name, column in named.items():
        if name not in known:
            raise IdentificationError(f"{path}: {name} is not a column of an identification: those are {', '.join(known)}")
        if column not in table:
            raise IdentificationError(f"{path} has no column {column}: it has {', '.join(table)}")
    chosen = {name: table[column] for name in known if (column := named.get(name, name)) in table}
    if "heading_deg" in chosen:
        chosen.setdefault("heading", np.radians(chosen["heading_deg"]))
    for name in (*NEEDED, "heading"):
        if name not in chosen:
            raise IdentificationError(
                f"{path} has no column {name}: it has {', '.join(table)}; give its name, as in {name}=COLUMN"
            )
    nothing, zero = np.full(len(chosen["time"]), np.nan), np.zeros(len(chosen["time"]))
    state = np.column_stack([chosen["x"], chosen["y"], chosen["heading"], *(chosen.get(name, nothing) for name in VELOCITIES)])
    wrench = np.column_stack([chosen.get(name, zero) for name in WRENCH])
    return judged(_measurements(chosen["time"], state, wrench, str(path)))


def _lines(stream: Iterable[str]) -> Iterator[str]:
    for line in stream:
        if len(line) > LONGEST_LINE:
            raise ValueError(f"a line has {len(line)} characters")
        yield line


def _table(path: Path) -> dict[str, Array]:
    """The columns of a CSV file by name; an empty field is NaN."""
    numbers = array("d")  # eight bytes for each number, where a list of lists would take sixty
    try:
        # Decoded line by line: as a text of four bytes for each character the largest file would take all memory.
        content = io.BytesIO(path.read_bytes())
        rows = (row for row in csv.reader(_lines(io.TextIOWrapper(content, "utf-8-sig", newline=""))) if row)
        header = [name.strip() for name in next(rows, [])]
        for number, row in enumerate(rows, 1):
            if len(row) != len(header):
                raise IdentificationError(f"cannot read {path}: {len(header)} names, but {len(row)} numbers in row {number}")
            numbers.extend(number_of(field) if field.strip() else math.nan for field in row)
            if len(numbers) > MOST_NUMBERS:
                raise IdentificationError(f"cannot read {path}: it has more than {MOST_NUMBERS} numbers")
    except (OSError, ValueError, csv.Error) as error:
        raise IdentificationError(f"cannot read {path} as a table of numbers with a row of names: {error}") from error
    if not numbers:
        raise IdentificationError(f"cannot read {path} as a table of numbers with a row of names: it has no numbers")
    if twice := [name for name, count in Counter(header).items() if count > 1]:
        raise IdentificationError(f"{path} has more than one column {twice[0]}")
    return dict(zip(header, np.array(numbers).reshape(-1, len(header)).T, strict=True))


def _measurements(time: Array, state: Array, wrench: Array, name: str) -> Measurements:
    """Measurements from a series of states; the heading is made continuous."""
    state = state.copy()
    if np.isfinite(state[:, 2]).all():
        state[:, 2] = np.unwrap(state[:, 2])
    # Velocities count only where all of them are measured.
    state[~np.isfinite(state[:, 3:]).all(axis=1), 3:] = np.nan
    run = Measurements(time, state[:, :3], state[:, 3:], wrench, name)
    return _fresh(checked(run))


def _fresh(run: Measurements) -> Measurements:
    """The samples at which the position has changed, where a slow sensor repeats its last one; the wrench is averaged between."""
    changed = np.append(True, (np.diff(run.pose[:, :2], axis=0) != 0.0).any(axis=1))
    moving = changed.sum() > 1
    if not moving or 1.0 - changed.mean() < HELD:
        return run
    rows = np.flatnonzero(changed)
    impulse = np.add.reduceat(run.wrench, rows, axis=0)
    counts = np.diff(np.append(rows, len(run.time)))[:, None]
    return run._replace(time=run.time[rows], pose=run.pose[rows], velocity=run.velocity[rows], wrench=impulse / counts)


STATE, COMMAND = Role("odometry", "odometry", (), True), Role("command", "wrench", (), False)


def judged(run: Measurements) -> Measurements:
    """The run itself, if its velocities, headings and positions agree; with what else is doubtful as its `doubts`.

    A jump of the positions leaves the estimates as they are, and signs are a conclusion from few manoeuvres: both are doubts.
    """
    run = _filled_in(run)
    connection = _connection(run)
    # Without measured velocities nothing can contradict the positions.
    findings = [*judge_motion(connection)] if np.isfinite(run.velocity).all() else []
    wrong = [finding for finding in findings if finding.level == WRONG]
    jumps = [finding for finding in wrong if "jump" in finding.text]
    if contradictions := [finding for finding in wrong if finding not in jumps]:
        about, text = contradictions[0][1:]
        raise IdentificationError(f"{run.name}: {about}: {text}")
    signs = [finding for finding in judge_signs(connection) if finding.level == WRONG] if len(findings) else []
    return run._replace(doubts=(*run.doubts, *(f"{about}: {text}" for _, about, text in (*jumps, *signs))))


def _filled_in(run: Measurements) -> Measurements:
    """The run without velocities that are zero throughout although the ship moves: their publisher does not fill them in."""
    if run.velocity.any() or not np.ptp(run.pose[:, :2], axis=0).any():
        return run
    doubt = "the velocities are 0 in all samples although the ship moves: those of the positions are taken"
    return run._replace(velocity=np.full_like(run.velocity, np.nan), doubts=(*run.doubts, doubt))


def _connection(run: Measurements) -> Connection:
    """Motion and wrench of a run, as the rules judge them."""
    columns = dict(zip(("x", "y", "psi", "u", "v", "r"), np.hstack([run.pose, run.velocity]).T, strict=True))
    forces = {"force": run.wrench[:, 0], "moment": run.wrench[:, 2]}
    topics = {STATE.topic: _topic(STATE, run.time, columns), COMMAND.topic: _topic(COMMAND, run.time, forces)}
    return Connection((STATE, COMMAND), topics, is_live=False)


def _topic(role: Role, time: Array, columns: dict[str, Array]) -> Topic:
    return Topic(role.topic, received=time, columns=columns)
