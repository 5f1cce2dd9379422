"""Rules for the failsafes of an autopilot: what stops the vessel when this computer, a radio, the battery or a sensor fails.

The values mean what the firmware's own descriptions say. ArduPilot: Rover/Parameters.cpp, failsafe.cpp, ekf_check.cpp,
crash_check.cpp and fence.cpp, libraries/AC_Fence, RC_Channel, AR_Motors and AP_BattMonitor. PX4: commander_params.yaml and
geofence_params.yaml. A parameter that has not come is not shown, and never OK.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from vessel_hsmc_ros.boats.autopilot import ARDUPILOT, NAMES, PX4
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Autopilot, Connection, Finding

Verdict = tuple[str, str]  # a level, and what the value means and what to set
Judge = Callable[[float, Autopilot], Verdict]


class Rule(NamedTuple):
    """A parameter, what it is, and what its value means for a vessel that this package steers."""

    names: tuple[str, ...]  # the first of them that has come counts: firmware renames parameters
    what: str
    judge: Judge
    goes_with: str = ""  # a parameter without effect where this one is 0


def options(ok: Mapping[int, str], others: Mapping[int, Verdict]) -> Judge:
    """The rule of a parameter that has some values by number."""
    table = {**{number: (OK, text) for number, text in ok.items()}, **others}

    def judge(value: float, _: Autopilot) -> Verdict:
        unknown = TODO, "a value that this check does not know: look it up in the documentation of the firmware"
        return table.get(int(value), unknown) if value == int(value) else unknown

    return judge


def between(low: float, high: float, ok: str, below: Verdict, above: Verdict) -> Judge:
    """The rule of a number that is to be above `low`, and at most `high`."""
    return lambda value, _: below if value <= low else above if value > high else (OK, ok)


def without_bits(bits: Mapping[int, Verdict], ok: str) -> Judge:
    """The rule of a mask in which some bits, by their values, must not be set."""
    return lambda value, _: next((verdict for bit, verdict in bits.items() if int(value) & bit), (OK, ok))


def own_system(value: float, autopilot: Autopilot) -> Verdict:
    """The rule of the ground station: MAV_GCS_SYSID to MAV_GCS_SYSID_HI, if that is not below, are the systems that count."""
    highest = max(value, autopilot.values.get("MAV_GCS_SYSID_HI", value))
    own = f"mavlink.system_id = {autopilot.system_id}"
    if value <= autopilot.system_id <= highest:
        return OK, f"accepts commands and heartbeats of {own}"
    return WRONG, f"ignores overrides, MANUAL_CONTROL and heartbeats of {own}: set both to one number"


def threshold(value: float, autopilot: Autopilot) -> Verdict:
    """The rule of the battery's thresholds, voltage and charge, of which one is enough."""
    charge = autopilot.values.get("BATT_LOW_MAH", 0.0)
    if value > 0.0 or charge > 0.0:
        return OK, f"counts as low below {f'{value:g} V' if value > 0.0 else f'{charge:g} mAh'}"
    return TODO, "with BATT_LOW_MAH 0 no battery ever counts as low: set the voltage"


HOLD = "the boat stops in HOLD"
HOME = "it sails home by itself: keep the way clear"

ARDUPILOT_RULES = (
    Rule(
        ("FS_ACTION",),
        "what a lost radio or ground station leads to",
        options(
            {1: HOME, 2: HOLD, 3: HOME, 4: f"{HOME}, or stops in HOLD"},
            {0: (WRONG, "nothing, so that neither stops the boat: set 2 (HOLD)")},
        ),
    ),
    Rule(
        ("FS_TIMEOUT",),
        "time, s, until a failsafe acts",
        between(
            0.0,
            5.0,
            "soon enough",
            (TODO, "at once, by a single lost packet: set 1.5"),
            (TODO, "the boat goes on so long: set 1.5"),
        ),
    ),
    Rule(
        ("FS_THR_ENABLE",),
        "failsafe of the radio",
        options(
            {1: "acts when the radio is lost", 2: "acts when the radio is lost, but in AUTO"},
            {0: (WRONG, "a boat out of reach of its radio goes on: set 1, and FS_THR_VALUE below the lowest throttle")},
        ),
    ),
    Rule(
        ("FS_GCS_ENABLE",),
        "failsafe of the heartbeats, which mavlink_node sends",
        options(
            {1: "acts when this computer falls silent", 2: "acts when this computer falls silent, but in AUTO"},
            {0: (WRONG, "nothing but RC_OVERRIDE_TIME acts when this computer dies: set 1")},
        ),
    ),
    Rule(
        ("FS_GCS_TIMEOUT",),
        "time, s, without a heartbeat until that failsafe acts",
        between(0.0, 5.0, "soon enough", (TODO, "it must be 2 s or more: set 3"), (TODO, "the boat goes on so long: set 3")),
        goes_with="FS_GCS_ENABLE",
    ),
    Rule(
        ("FS_CRASH_CHECK",),
        "what a boat that does not move under thrust in GUIDED or AUTO leads to",
        options(
            {0: "nothing; a boat that keeps its station against a current is no crash"},
            {
                1: (TODO, "HOLD, also where the boat keeps its station against a current: 0 if it is to do that in GUIDED"),
                2: (TODO, "disarmed, also where the boat keeps its station against a current: 0 if it is to do that in GUIDED"),
            },
        ),
    ),
    Rule(
        ("FS_EKF_ACTION",),
        "what a lost position leads to in GUIDED and AUTO",
        options(
            {1: HOLD},
            {
                0: (WRONG, "nothing: a boat in GUIDED goes on without a position: set 1 (HOLD)"),
                2: (TODO, "a report alone: a boat in GUIDED goes on without a position: set 1 (HOLD)"),
            },
        ),
    ),
    Rule(
        ("FS_EKF_THRESH",),
        "variance above which the position counts as lost",
        between(
            0.0,
            1.0,
            "within the documented values",
            (WRONG, "the filter is not watched: set 0.8"),
            (TODO, "above all documented values: set 0.8"),
        ),
    ),
    Rule(
        ("FENCE_ENABLE",),
        "fence of the autopilot",
        options(
            {1: "on"},
            {0: (TODO, "off: nothing but this computer keeps the boat in its waters; set 1 with a fence around them")},
        ),
    ),
    Rule(
        ("FENCE_ACTION",),
        "what a crossed fence leads to",
        options(
            {1: HOME, 2: HOLD, 3: HOME, 4: f"{HOME}, or stops in HOLD", 5: "it is disarmed"},
            {0: (WRONG, "a report alone: set 2 (HOLD)")},
        ),
        goes_with="FENCE_ENABLE",
    ),
    Rule(
        ("FENCE_TYPE",),
        "kinds of fences that count",
        lambda value, _: (OK, "circle or polygons") if int(value) & 6 else (WRONG, "none: set 6 (circle and polygons)"),
        goes_with="FENCE_ENABLE",
    ),
    Rule(
        ("RC_OVERRIDE_TIME",),
        "time, s, for which the last command of this computer holds once it is silent",
        lambda value, autopilot: (
            (WRONG, "no time: commands are ignored; set 1")
            if value == 0.0
            else between(
                0.0,
                3.0,
                "then the sticks count again; 1 is enough",
                (WRONG, "the last command holds until the radio is switched: set 1"),
                (WRONG, "the boat goes on so long: set 1"),
            )(value, autopilot)
        ),
    ),
    Rule(
        ("RC_OPTIONS",),
        "options of the radio",
        without_bits(
            {
                1: (WRONG, "bit 0: the receiver is ignored, and no person can take over: clear it"),
                2: (WRONG, "bit 1: the commands of this computer are ignored: clear it"),
                4: (
                    TODO,
                    "bit 2: the failsafe flag of the receiver is ignored: clear it, or test that a lost radio stops the boat",
                ),
            },
            "neither the receiver nor overrides are ignored",
        ),
    ),
    Rule(
        ("MOT_THR_MIN",),
        "least throttle, % of the full one, that a command not 0 leads to",
        lambda value, _: (
            (OK, "none is added") if value == 0.0 else (TODO, "small forces come out larger: 0 unless the motors need it")
        ),
    ),
    Rule(("MAV_GCS_SYSID", "SYSID_MYGCS"), "system of the ground station", own_system),
    Rule(
        ("BATT_MONITOR",),
        "kind of battery monitor",
        lambda value, _: (OK, "there is one") if value else (TODO, "none: no battery ever counts as low; set the kind of yours"),
    ),
    Rule(
        ("BATT_FS_LOW_ACT",),
        "what a low battery leads to",
        options(
            {1: HOME, 2: HOLD, 3: HOME, 4: f"{HOME}, or stops in HOLD", 5: "it is disarmed, and drifts"},
            {0: (TODO, "nothing: set 1 (RTL) while there is charge for the way home, or 2 (HOLD)")},
        ),
        goes_with="BATT_MONITOR",
    ),
    Rule(("BATT_LOW_VOLT",), "voltage below which the battery counts as low", threshold, goes_with="BATT_MONITOR"),
)

STICKS = "a person must have the sticks in hand then: set 5 (Hold) or 7 (disarmed)"

PX4_RULES = (
    Rule(
        ("COM_OF_LOSS_T",),
        "time, s, without this computer until Offboard ends",
        between(
            0.0, 2.0, "soon enough", (TODO, "at once, by a single gap: set 1"), (WRONG, "the last setpoint holds so long: set 1")
        ),
    ),
    Rule(
        ("COM_OBL_RC_ACT",),
        "what the loss of this computer leads to",
        options(
            {3: HOME, 5: "Hold", 6: "outputs off", 7: "disarmed"},
            {
                0: (TODO, f"Position mode: {STICKS}"),
                1: (TODO, f"Altitude mode: {STICKS}"),
                2: (TODO, f"Stabilized: {STICKS}"),
                4: (TODO, "Land mode, which a boat does not have: set 5 (Hold) or 7 (disarmed)"),
            },
        ),
    ),
    Rule(
        ("NAV_RCL_ACT",),
        "what a lost radio leads to",
        options(
            {1: "Hold", 2: HOME, 5: "outputs off", 6: "disarmed"},
            {
                0: (WRONG, "nothing: a boat out of reach of its radio goes on: set 1 (Hold)"),
                3: (TODO, "Land mode, which a boat does not have: set 1 (Hold)"),
            },
        ),
    ),
    Rule(
        ("COM_RCL_EXCEPT",),
        "modes in which a lost radio does not count",
        without_bits({4: (WRONG, "Offboard is one of them: clear bit 2")}, "Offboard is none of them"),
    ),
    Rule(
        ("NAV_DLL_ACT",),
        "what a lost ground station leads to",
        options(
            {1: "Hold", 2: HOME, 5: "outputs off", 6: "disarmed"},
            {
                0: (TODO, "nothing: set 1 (Hold) if one watches the boat"),
                3: (TODO, "Land mode, which a boat does not have: set 1 (Hold)"),
            },
        ),
    ),
    Rule(
        ("GF_ACTION",),
        "what a crossed fence leads to",
        options(
            {2: "Hold", 3: HOME, 4: "outputs off"},
            {
                0: (TODO, "nothing: set 2 (Hold)"),
                1: (TODO, "a warning alone: set 2 (Hold)"),
                5: (TODO, "Land mode, which a boat does not have: set 2 (Hold)"),
            },
        ),
    ),
    Rule(
        ("GF_MAX_HOR_DIST",),
        "largest distance from home, m",
        lambda value, _: (OK, "on") if value > 0.0 else (TODO, "off: set it, or upload a fence around your waters"),
    ),
    Rule(
        ("COM_LOW_BAT_ACT",),
        "what a low battery leads to",
        options(
            {3: HOME, 4: HOME},
            {
                0: (TODO, "a warning alone: set 3 (Return)"),
                2: (TODO, "Land mode, which a boat does not have: set 3 (Return)"),
            },
        ),
    ),
)

SILENCE = {
    "mavlink": "start mavlink_node, which reads the parameters of the autopilot, and check again",
    "px4": "PX4 has no parameters on its topics. See in QGroundControl that COM_OF_LOSS_T is 1, COM_OBL_RC_ACT 5 or 7,"
    " NAV_RCL_ACT 1 and COM_RCL_EXCEPT without bit 2: else a boat without computer or radio goes on",
}
"""Why an autopilot tells nothing, by the node that connects it, and what to do."""

UNHEARD = "mavlink_node hears no ArduPilot or PX4: see that it is switched on, and mavlink.connection"
UNREQUESTED = "mavlink.stream_rate is 0, so that nothing is requested from the autopilot: raise it"

RULES = {ARDUPILOT: ARDUPILOT_RULES, PX4: PX4_RULES}


def autopilot_of(node: str, told: Mapping[str, str]) -> Autopilot | None:
    """What an autopilot tells by the diagnostics of mavlink_node; None for a stack without an autopilot that is read.

    `node`: the node that connects it, or the name of the stack. `told`: keys and values of the diagnostics, empty without any.
    """
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
