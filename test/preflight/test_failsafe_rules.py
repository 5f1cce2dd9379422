"""Each parameter of the failsafes of an autopilot: a line that says whether the vessel is without one, and what to set."""

import pytest
from connections import healthy
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.failsafes import ARDUPILOT, NAMES, PX4, RULES
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Autopilot, Finding
from vessel_hsmc_ros.preflight.failsafe_rules import SILENCE, autopilot_of, judge_failsafes
from vessel_hsmc_ros.preflight.rules import judge

SAFE: dict[str, dict[str, float]] = {
    ARDUPILOT: {
        **{"FS_ACTION": 2, "FS_TIMEOUT": 1.5, "FS_THR_ENABLE": 1, "FS_GCS_ENABLE": 1, "FS_GCS_TIMEOUT": 3, "FS_CRASH_CHECK": 0},
        **{
            "FS_EKF_ACTION": 1,
            "FS_EKF_THRESH": 0.8,
            "FENCE_ENABLE": 1,
            "FENCE_ACTION": 2,
            "FENCE_TYPE": 6,
            "RC_OVERRIDE_TIME": 1,
        },
        **{"RC_OPTIONS": 0, "MOT_THR_MIN": 0, "MAV_GCS_SYSID": 255, "BATT_MONITOR": 4, "BATT_FS_LOW_ACT": 2, "BATT_LOW_VOLT": 11},
    },
    PX4: {
        **{"COM_OF_LOSS_T": 1, "COM_OBL_RC_ACT": 5, "NAV_RCL_ACT": 1, "COM_RCL_EXCEPT": 0, "NAV_DLL_ACT": 1, "GF_ACTION": 2},
        **{"GF_MAX_HOR_DIST": 200, "COM_LOW_BAT_ACT": 3},
    },
}
WITHOUT: dict[str, dict[str, float]] = {
    ARDUPILOT: {
        **{"FS_ACTION": 0, "FS_THR_ENABLE": 0, "FS_GCS_ENABLE": 0, "FS_EKF_ACTION": 0, "FS_EKF_THRESH": 0, "FENCE_ACTION": 0},
        **{"FENCE_TYPE": 0, "RC_OVERRIDE_TIME": -1, "RC_OPTIONS": 2, "MAV_GCS_SYSID": 1},
    },
    PX4: {"COM_OF_LOSS_T": 10, "NAV_RCL_ACT": 0, "COM_RCL_EXCEPT": 4},
}
"""Values with which a vessel that this package steers is not stopped, or not steered."""

FLIPPED = [(firmware, name) for firmware, values in WITHOUT.items() for name in values]


def lines(firmware: str, **values: float) -> dict[str, Finding]:
    autopilot = Autopilot(firmware, {**SAFE[firmware], **values}, 255)
    return {found.about: found for found in judge_failsafes(healthy()._replace(autopilot=autopilot))}


@pytest.mark.parametrize("firmware", RULES)
def test_an_autopilot_with_all_failsafes_has_a_line_for_each_of_them(firmware: str) -> None:
    found = lines(firmware)
    assert {each.level for each in found.values()} == {OK}
    assert list(found) == [rule.names[0] for rule in RULES[firmware]]


@pytest.mark.parametrize("firmware", RULES)
def test_the_parameters_that_are_read_are_those_that_are_judged(firmware: str) -> None:
    judged = {name for rule in RULES[firmware] for name in rule.names}
    assert judged <= set(NAMES[firmware])
    assert set(NAMES[firmware]) - judged <= {"MAV_GCS_SYSID_HI", "BATT_LOW_MAH"}, "which belong to the rule of another one"


@pytest.mark.long
@given(st.sets(st.sampled_from(FLIPPED), min_size=1))
def test_those_that_are_off_are_wrong_and_no_other(flipped: set[tuple[str, str]]) -> None:
    for firmware in RULES:
        off = {name: WITHOUT[firmware][name] for f, name in flipped if f == firmware}
        found = lines(firmware, **off)
        assert {name for name, each in found.items() if each.level == WRONG} == set(off)
        assert all(f"{off[name]:g}, " in found[name].text for name in off)


@given(st.data())
def test_a_parameter_that_has_not_come_is_not_shown_and_never_ok(data: st.DataObject) -> None:
    firmware = data.draw(st.sampled_from(list(RULES)))
    missing = data.draw(st.sets(st.sampled_from(list(SAFE[firmware]))))
    known = {name: value for name, value in SAFE[firmware].items() if name not in missing}
    found = [*judge_failsafes(healthy()._replace(autopilot=Autopilot(firmware, known, 255)))]
    shown = {name for each in found if each.level == OK for name in each.about.split(" or ")}
    assert not shown & missing
    assert all("not shown" in each.text for each in found if set(each.about.split(" or ")) & missing)


@pytest.mark.long
@given(st.sampled_from(list(RULES)), st.data())
def test_any_number_has_a_verdict(firmware: str, data: st.DataObject) -> None:
    values = {name: data.draw(st.floats(allow_nan=False, allow_infinity=False, width=32)) for name in SAFE[firmware]}
    assert all(each.level in (OK, TODO, WRONG) and each.text for each in lines(firmware, **values).values())


def test_what_has_no_effect_has_no_line() -> None:
    off = lines(ARDUPILOT, FENCE_ENABLE=0, FENCE_ACTION=0, FENCE_TYPE=0, BATT_MONITOR=0, BATT_FS_LOW_ACT=0)
    assert not {"FENCE_ACTION", "FENCE_TYPE", "BATT_FS_LOW_ACT", "BATT_LOW_VOLT"} & set(off)
    assert {off["FENCE_ENABLE"].level, off["BATT_MONITOR"].level} == {TODO}


@pytest.mark.parametrize(
    ("values", "system", "level"),
    [
        ({"MAV_GCS_SYSID": 255.0}, 255, OK),
        ({"MAV_GCS_SYSID": 250.0}, 255, WRONG),
        ({"MAV_GCS_SYSID": 250.0, "MAV_GCS_SYSID_HI": 255.0}, 252, OK),
        ({"MAV_GCS_SYSID": 250.0, "MAV_GCS_SYSID_HI": 0.0}, 252, WRONG),
        ({"SYSID_MYGCS": 255.0}, 255, OK),
        ({"SYSID_MYGCS": 255.0}, 7, WRONG),
    ],
)
def test_the_system_that_is_obeyed_is_found_by_either_name(values: dict[str, float], system: int, level: str) -> None:
    known = {name: value for name, value in SAFE[ARDUPILOT].items() if name != "MAV_GCS_SYSID"} | values
    found = judge_failsafes(healthy()._replace(autopilot=Autopilot(ARDUPILOT, known, system)))
    assert next(each for each in found if "SYSID" in each.about).level == level


def test_either_threshold_of_the_battery_is_enough() -> None:
    assert lines(ARDUPILOT, BATT_LOW_VOLT=0, BATT_LOW_MAH=900)["BATT_LOW_VOLT"].level == OK
    assert lines(ARDUPILOT, BATT_LOW_VOLT=0, BATT_LOW_MAH=0)["BATT_LOW_VOLT"].level == TODO


@pytest.mark.parametrize("node", SILENCE)
def test_a_stack_whose_autopilot_tells_nothing_has_one_line_and_others_none(node: str) -> None:
    silent = healthy()._replace(autopilot=autopilot_of(node, {}))
    found = [each for each in judge(silent) if each.about == "failsafes"]
    assert [(each.level, each.text.startswith("not shown: ")) for each in found] == [(TODO, True)]
    assert autopilot_of("vrx", {}) is None
    assert not [each for each in judge(healthy()) if each.about == "failsafes"]


def test_what_mavlink_node_tells_is_read_and_what_it_does_not_request_is_named() -> None:
    told = {"firmware": ARDUPILOT, "system_id": "255", "requests": "True", "FS_ACTION": "0.0"}
    made = autopilot_of("mavlink", told)
    assert made is not None
    assert (made.firmware, dict(made.values), made.system_id) == (ARDUPILOT, {"FS_ACTION": 0.0}, 255)
    for change, word in (({"firmware": ""}, "hears no"), ({"requests": "False"}, "stream_rate is 0")):
        made = autopilot_of("mavlink", told | change)
        found = [*judge_failsafes(healthy()._replace(autopilot=made))]
        assert [each.level for each in found] == [TODO]
        assert word in found[0].text
