"""The failsafes of an autopilot: the parameters that decide what stops the vessel, what their values mean, and how they are read.

The values mean what the firmware's own descriptions say. ArduPilot: Rover/Parameters.cpp, failsafe.cpp, ekf_check.cpp and
crash_check.cpp, libraries/AC_Fence, libraries/RC_Channel/RC_Channels_VarInfo.h, AR_Motors, AP_BattMonitor and GCS_MAVLink
(MAV_GCS_SYSID; in older firmware SYSID_MYGCS). PX4: src/modules/commander/commander_params.yaml and
src/modules/navigator/geofence_params.yaml.
"""

import math
import struct
from typing import NamedTuple

ARDUPILOT, PX4 = "ArduPilot", "PX4"

Verdict = tuple[str, str]  # ok, todo or wrong, and what the value means and what to set
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
MAV_GCS_SYSID SYSID_MYGCS and MAV_GCS_SYSID_HI: system of the ground station
BATT_MONITOR: kind of battery monitor
  0 todo: none: no battery ever counts as low; set the kind of yours
  else ok: there is one
BATT_FS_LOW_ACT with BATT_MONITOR: what a low battery leads to
  0 todo: nothing: set 1 (RTL) while there is charge for the way home, or 2 (HOLD)
  {ACTIONS}
  5 ok: it is disarmed, and drifts
BATT_LOW_VOLT and BATT_LOW_MAH with BATT_MONITOR: voltage below which the battery counts as low
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
"""By parameter: one that is read with it, the one without which it has no effect, what it is, and its verdicts by values, of
which the first counts: equal, at most, above, with a bit of a mask, any other. Of two names the first one that has come counts:
firmware renames them."""


class Rule(NamedTuple):
    """What the values of a parameter mean."""

    names: tuple[str, ...]  # its names, of which each firmware has one
    beside: str  # another parameter that is read with it
    goes_with: str  # the parameter without which it has no effect
    what: str
    verdicts: tuple[tuple[str, Verdict], ...]  # by values

    def verdict(self, value: float) -> Verdict | None:
        """What a value means; None for one that is not in the table."""
        return next((verdict for values, verdict in self.verdicts if any(holds(value, each) for each in values.split())), None)


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
            names, _, beside = names.partition(" and ")
            found.append(Rule(tuple(names.split()), beside, goes_with, text, ()))
    return tuple(found)


RULES = {ARDUPILOT: rules_of(ARDUPILOT_RULES), PX4: rules_of(PX4_RULES)}
NAMES = {
    firmware: tuple(name for rule in rules for name in (*rule.names, rule.beside) if name) for firmware, rules in RULES.items()
}
"""The parameters that are read, by firmware."""

FIRMWARE = {3: ARDUPILOT, 12: PX4}  # by MAV_AUTOPILOT of HEARTBEAT
INTEGERS = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i"}  # by MAV_PARAM_TYPE: how PX4 packs whole numbers

BURST, TRIES = 8, 3  # requests at a time for parameters that have not come, and how often each of them is requested so
RENEWED = 3  # requests at a time later, in turn: all are renewed within the 8 s of a check


def decoded(value: float, kind: int, firmware: str) -> float:
    """The number of PARAM_VALUE, in whose field of a float PX4 packs the bytes of whole numbers; ArduPilot converts them."""
    if firmware != PX4 or kind not in INTEGERS:
        return value
    return float(struct.unpack_from(INTEGERS[kind], struct.pack("<f", value))[0])


class ParameterReader:
    """Which parameters to request next, and the values that have come.

    A few are requested at a time, so that a radio modem keeps room for other messages. Later they are requested again in turn,
    as a person changes them. An autopilot does not answer the request of a parameter that it does not have. `firmware`:
    ArduPilot, PX4, or empty before a heartbeat of one of them. `values`: values by name.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget an autopilot that has fallen silent: it may come back as another one."""
        self.firmware, self._turn = "", 0
        self.values: dict[str, float] = {}
        self._tries: dict[str, int] = {}

    def heard(self, autopilot: int) -> None:
        """Take the kind of autopilot of a heartbeat."""
        self.firmware = FIRMWARE.get(autopilot, "")

    def take(self, name: str, value: float, kind: int) -> None:
        """Take PARAM_VALUE; other parameters, which ground stations request, and numbers that are not finite do not count."""
        number = decoded(value, kind, self.firmware)
        if name in NAMES.get(self.firmware, ()) and math.isfinite(number):
            self.values[name] = number

    def due(self) -> list[str]:
        """The names to request now, of which a call each second is enough."""
        names = NAMES.get(self.firmware, ())
        awaited = [name for name in names if name not in self.values and self._tries.get(name, 0) < TRIES][:BURST]
        if not awaited and names:
            awaited = [names[(self._turn + k) % len(names)] for k in range(RENEWED)]
            self._turn += RENEWED
        for name in awaited:
            self._tries[name] = self._tries.get(name, 0) + 1
        return awaited
