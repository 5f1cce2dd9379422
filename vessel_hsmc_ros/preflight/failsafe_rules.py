"""Rules for the failsafes of an autopilot: what stops the vessel when this computer, a radio, the battery or a sensor fails.

The values mean what the firmware's own descriptions say. ArduPilot: Rover/Parameters.cpp, failsafe.cpp, ekf_check.cpp,
crash_check.cpp and fence.cpp, libraries/AC_Fence, RC_Channel, AR_Motors and AP_BattMonitor. PX4: commander_params.yaml and
geofence_params.yaml. A parameter that has not come is not shown, and never OK.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from vessel_hsmc_ros.boats.autopilot import ARDUPILOT, NAMES, PX4
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Autopilot, Connection, Finding

Verdict = tuple[str, str]  # a level, and what the value means and what to set
HOLD, HOME = "the boat stops in HOLD", "it sails home by itself: keep the way clear"
STICKS = "a person must have the sticks in hand then: set 5 (Hold) or 7 (disarmed)"
LAND = "Land mode, which a boat does not have: set"
ACTIONS = f"""1 3 ok: {HOME}
  2 ok: {HOLD}
  4 ok: {HOME}, or stops in HOLD"""
MODES = f"""1 ok: Hold
  2 ok: {HOME}
  3 todo: {LAND} 1 (Hold)
  5 ok: outputs off
  6 ok: disarmed"""
"""What most actions of ArduPilot, and of PX4, have in common."""

ARDUPILOT_RULES = f"""
FS_ACTION: what a lost radio or ground station leads to
  0 wrong: nothing, so that neither stops the boat: set 2 (HOLD)
  {ACTIONS}
FS_TIMEOUT: time, s, until a failsafe acts
  <=0 todo: at once, by a single lost packet: set 1.5
  >5 todo: the boat goes on so long: set 1.5
  else ok: soon enough
FS_THR_ENABLE: failsafe of the radio
  0 wrong: a boat out of reach of its radio goes on: set 1, and FS_THR_VALUE below the lowest throttle
  1 ok: acts when the radio is lost
  2 ok: acts when the radio is lost, but in AUTO
FS_GCS_ENABLE: failsafe of the heartbeats, which mavlink_node sends
  0 wrong: nothing but RC_OVERRIDE_TIME acts when this computer dies: set 1
  1 ok: acts when this computer falls silent
  2 ok: acts when this computer falls silent, but in AUTO
FS_GCS_TIMEOUT with FS_GCS_ENABLE: time, s, without a heartbeat until that failsafe acts
  <=0 todo: it must be 2 s or more: set 3
  >5 todo: the boat goes on so long: set 3
  else ok: soon enough
FS_CRASH_CHECK: what a boat that does not move under thrust in GUIDED or AUTO leads to
  0 ok: nothing; a boat that keeps its station against a current is no crash
  1 todo: HOLD, also where the boat keeps its station against a current: 0 if it is to do that in GUIDED
  2 todo: disarmed, also where the boat keeps its station against a current: 0 if it is to do that in GUIDED
FS_EKF_ACTION: what a lost position leads to in GUIDED and AUTO
  0 wrong: nothing: a boat in GUIDED goes on without a position: set 1 (HOLD)
  1 ok: {HOLD}
  2 todo: a report alone: a boat in GUIDED goes on without a position: set 1 (HOLD)
FS_EKF_THRESH: variance above which the position counts as lost
  <=0 wrong: the filter is not watched: set 0.8
  >1 todo: above all documented values: set 0.8
  else ok: within the documented values
FENCE_ENABLE: fence of the autopilot
  0 todo: off: nothing but this computer keeps the boat in its waters; set 1 with a fence around them
  1 ok: on
FENCE_ACTION with FENCE_ENABLE: what a crossed fence leads to
  0 wrong: a report alone: set 2 (HOLD)
  {ACTIONS}
  5 ok: it is disarmed
FENCE_TYPE with FENCE_ENABLE: kinds of fences that count
  &6 ok: circle or polygons
  else wrong: none: set 6 (circle and polygons)
RC_OVERRIDE_TIME: time, s, for which the last command of this computer holds once it is silent
  0 wrong: no time: commands are ignored; set 1
  <=0 wrong: the last command holds until the radio is switched: set 1
  >3 wrong: the boat goes on so long: set 1
  else ok: then the sticks count again; 1 is enough
RC_OPTIONS: options of the radio
  &1 wrong: bit 0: the receiver is ignored, and no person can take over: clear it
  &2 wrong: bit 1: the commands of this computer are ignored: clear it
  &4 todo: bit 2: the failsafe flag of the receiver is ignored: clear it, or test that a lost radio stops the boat
  else ok: neither the receiver nor overrides are ignored
MOT_THR_MIN: least throttle, % of the full one, that a command not 0 leads to
  0 ok: none is added
  else todo: small forces come out larger: 0 unless the motors need it
MAV_GCS_SYSID SYSID_MYGCS: system of the ground station
BATT_MONITOR: kind of battery monitor
  0 todo: none: no battery ever counts as low; set the kind of yours
  else ok: there is one
BATT_FS_LOW_ACT with BATT_MONITOR: what a low battery leads to
  0 todo: nothing: set 1 (RTL) while there is charge for the way home, or 2 (HOLD)
  {ACTIONS}
  5 ok: it is disarmed, and drifts
BATT_LOW_VOLT with BATT_MONITOR: voltage below which the battery counts as low
"""
PX4_RULES = f"""
COM_OF_LOSS_T: time, s, without this computer until Offboard ends
  <=0 todo: at once, by a single gap: set 1
  >2 wrong: the last setpoint holds so long: set 1
  else ok: soon enough
COM_OBL_RC_ACT: what the loss of this computer leads to
  0 todo: Position mode: {STICKS}
  1 todo: Altitude mode: {STICKS}
  2 todo: Stabilized: {STICKS}
  3 ok: {HOME}
  4 todo: {LAND} 5 (Hold) or 7 (disarmed)
  5 ok: Hold
  6 ok: outputs off
  7 ok: disarmed
NAV_RCL_ACT: what a lost radio leads to
  0 wrong: nothing: a boat out of reach of its radio goes on: set 1 (Hold)
  {MODES}
COM_RCL_EXCEPT: modes in which a lost radio does not count
  &4 wrong: Offboard is one of them: clear bit 2
  else ok: Offboard is none of them
NAV_DLL_ACT: what a lost ground station leads to
  0 todo: nothing: set 1 (Hold) if one watches the boat
  {MODES}
GF_ACTION: what a crossed fence leads to
  0 todo: nothing: set 2 (Hold)
  1 todo: a warning alone: set 2 (Hold)
  2 ok: Hold
  3 ok: {HOME}
  4 ok: outputs off
  5 todo: {LAND} 2 (Hold)
GF_MAX_HOR_DIST: largest distance from home, m
  >0 ok: on
  else todo: off: set it, or upload a fence around your waters
COM_LOW_BAT_ACT: what a low battery leads to
  0 todo: a warning alone: set 3 (Return)
  2 todo: {LAND} 3 (Return)
  3 4 ok: {HOME}
"""
"""By parameter: the one without which it has no effect, what it is, and its verdicts by values, of which the first counts: equal,
at most, above, with a bit of a mask, any other. Of two names the first one that has come counts: firmware renames them."""


class Rule(NamedTuple):
    """A parameter by its names, what it is, the one without which it has no effect, and the verdicts by values."""

    names: tuple[str, ...]
    what: str
    goes_with: str
    verdicts: tuple[tuple[str, Verdict], ...]

    def judge(self, value: float, autopilot: Autopilot) -> Verdict:
        """What its value means for a vessel that this package steers."""
        if special := SPECIAL.get(self.names[0]):
            return special(value, autopilot)
        unknown = TODO, "a value that this check does not know: look it up in the documentation of the firmware"
        return next((verdict for values, verdict in self.verdicts if any(holds(value, each) for each in values.split())), unknown)


def holds(value: float, condition: str) -> bool:
    """Whether a value is as a condition of the table has it."""
    if condition.startswith("&"):
        return bool(int(value) & int(condition[1:]))
    if condition[0] in "<>":
        return value <= float(condition[2:]) if condition[0] == "<" else value > float(condition[1:])
    return condition == "else" or value == float(condition)


def rules_of(table: str) -> tuple[Rule, ...]:
    """The rules of a table."""
    found: list[Rule] = []
    for line in table.strip().splitlines():
        head, _, text = line.partition(": ")
        if line.startswith(" "):
            values, level = head.strip().rsplit(" ", 1)
            found[-1] = found[-1]._replace(verdicts=(*found[-1].verdicts, (values, (level, text))))
        else:
            names, _, goes_with = head.partition(" with ")
            found.append(Rule(tuple(names.split()), text, goes_with, ()))
    return tuple(found)


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
RULES = {ARDUPILOT: rules_of(ARDUPILOT_RULES), PX4: rules_of(PX4_RULES)}

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
    value = autopilot.values[name]
    level, text = rule.judge(value, autopilot)
    return Finding(level, name, f"{value:g}, {rule.what}: {text}")
