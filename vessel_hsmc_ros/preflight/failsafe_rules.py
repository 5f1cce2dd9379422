"""Rules for the failsafes of an autopilot: what stops the vessel when this computer, a radio, the battery or a sensor fails.

A parameter that has not come is not shown, and never OK.
"""

from collections.abc import Iterator, Mapping

from vessel_hsmc_ros.boats.failsafes import NAMES, RULES, Rule, Verdict
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Autopilot, Connection, Finding

UNKNOWN = TODO, "a value that this check does not know: look it up in the documentation of the firmware"


def own_system(value: float, autopilot: Autopilot) -> Verdict:
    """Of the ground station: MAV_GCS_SYSID to MAV_GCS_SYSID_HI, if that is not below, are the systems that count."""
    highest = max(value, autopilot.values.get("MAV_GCS_SYSID_HI", value))
    own = f"mavlink.system_id = {autopilot.system_id}"
    if value <= autopilot.system_id <= highest:
        return OK, f"accepts commands and heartbeats of {own}"
    return WRONG, f"ignores overrides, MANUAL_CONTROL and heartbeats of {own}: set both to one number"


def threshold(value: float, autopilot: Autopilot) -> Verdict:
    """Of the battery's thresholds, voltage and charge, of which one is enough."""
    charge = autopilot.values.get("BATT_LOW_MAH", 0.0)
    if value > 0.0 or charge > 0.0:
        return OK, f"counts as low below {f'{value:g} V' if value > 0.0 else f'{charge:g} mAh'}"
    return TODO, "with BATT_LOW_MAH 0 no battery ever counts as low: set the voltage"


SPECIAL = {"MAV_GCS_SYSID": own_system, "BATT_LOW_VOLT": threshold}

SILENCE = {
    "mavlink": "start mavlink_node, which reads the parameters of the autopilot, and check again",
    "px4": "PX4 has no parameters on its topics. See in QGroundControl that COM_OF_LOSS_T is 1, COM_OBL_RC_ACT 5 or 7,"
    " NAV_RCL_ACT 1 and COM_RCL_EXCEPT without bit 2: else a boat without computer or radio goes on",
}
"""Why an autopilot tells nothing, by the node that connects it, and what to do."""

UNHEARD = "mavlink_node hears no ArduPilot or PX4: see that it is switched on, and mavlink.connection"
UNREQUESTED = "mavlink.stream_rate is 0, so that nothing is requested from the autopilot: raise it"


def autopilot_of(node: str, told: Mapping[str, str]) -> Autopilot | None:
    """What an autopilot tells by the diagnostics of mavlink_node; None for a stack without an autopilot that is read."""
    if node not in SILENCE:
        return None
    if not told:
        return Autopilot(silence=SILENCE[node])
    if told.get("requests") == "False":
        return Autopilot(silence=UNREQUESTED)
    names = NAMES.get(told["firmware"], ())
    values = {name: float(told[name]) for name in names if name in told}
    return Autopilot(told["firmware"], values, int(told["system_id"]), UNHEARD)


def judge_failsafes(connection: Connection) -> Iterator[Finding]:
    """A line for each parameter of the autopilot that decides what stops the vessel; nothing for a stack without an autopilot."""
    autopilot = connection.autopilot
    if autopilot is None:
        return
    if not autopilot.firmware:
        yield Finding(TODO, "failsafes", f"not shown: {autopilot.silence}")
        return
    for rule in RULES[autopilot.firmware]:
        if autopilot.values.get(rule.goes_with, 1.0) != 0.0:
            yield judged(rule, autopilot)


def judged(rule: Rule, autopilot: Autopilot) -> Finding:
    """The line of a parameter."""
    name = next((name for name in rule.names if name in autopilot.values), None)
    if name is None:
        text = f"not shown: the autopilot does not tell it; {rule.what}: look it up in a ground station"
        return Finding(TODO, " or ".join(rule.names), text)
    value, special = autopilot.values[name], SPECIAL.get(rule.names[0])
    level, text = special(value, autopilot) if special else rule.verdict(value) or UNKNOWN
    return Finding(level, name, f"{value:g}, {rule.what}: {text}")
