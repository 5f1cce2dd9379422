"""Whether recorded motion and forces can be those of one ship, by the rules of `vessel-hsmc check`.

The equations of motion take times, frames and signs for granted. Data that contradict them give wrong hull data, or a motion that
diverges, and no residual shows the cause.
"""

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification.types import Measurements
from vessel_hsmc_ros.safety.connection import WRONG, Connection, Role, Topic
from vessel_hsmc_ros.safety.motion_rules import judge_motion
from vessel_hsmc_ros.safety.sign_rules import judge_signs

STATE, COMMAND = Role("odometry", "odometry", (), True), Role("command", "wrench", (), False)


def judged(run: Measurements) -> Measurements:
    """The run itself, if its velocities, headings and positions agree; with what else is doubtful as its `doubts`.

    A jump of the positions leaves the estimates as they are, and signs are a conclusion from few manoeuvres: both are doubts.

    Raises:
        IdentificationError: the motion contradicts itself, as one of another frame or unit.
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
