"""The parameters of an autopilot that decide what stops a vessel when a link or a sensor fails, and how they are read.

Names as in ArduPilot's Rover/Parameters.cpp, libraries/AC_Fence/AC_Fence.cpp, libraries/RC_Channel/RC_Channels_VarInfo.h,
libraries/AP_BattMonitor and libraries/GCS_MAVLink (MAV_GCS_SYSID; in older firmware SYSID_MYGCS), and in PX4's
src/modules/commander/commander_params.yaml and src/modules/navigator/geofence_params.yaml.
"""

import math
import struct

ARDUPILOT, PX4 = "ArduPilot", "PX4"

NAMES = {
    ARDUPILOT: (
        *("FS_ACTION", "FS_TIMEOUT", "FS_THR_ENABLE", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "FS_CRASH_CHECK", "FS_EKF_ACTION"),
        *("FS_EKF_THRESH", "FENCE_ENABLE", "FENCE_ACTION", "FENCE_TYPE", "RC_OVERRIDE_TIME", "RC_OPTIONS", "MOT_THR_MIN"),
        *("MAV_GCS_SYSID", "MAV_GCS_SYSID_HI", "SYSID_MYGCS", "BATT_MONITOR", "BATT_FS_LOW_ACT", "BATT_LOW_VOLT", "BATT_LOW_MAH"),
    ),
    PX4: (
        *("COM_OF_LOSS_T", "COM_OBL_RC_ACT", "NAV_RCL_ACT", "COM_RCL_EXCEPT", "NAV_DLL_ACT", "GF_ACTION", "GF_MAX_HOR_DIST"),
        "COM_LOW_BAT_ACT",
    ),
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

    A few are requested at a time, so that a radio modem keeps room for other messages. Later they are requested again in turn, as
    a person changes them. An autopilot does not answer the request of a parameter that it does not have.

    Attributes:
        firmware: ArduPilot, PX4, or empty before a heartbeat of one of them.
        values: Values by name.
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
