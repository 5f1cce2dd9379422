"""The error of a node where ROS 2 security (SROS2) is demanded but not available: it does not start, for a reason of one line."""

import os

ENABLE, KEYSTORE = "ROS_SECURITY_ENABLE", "ROS_SECURITY_KEYSTORE"

_NOT_BUILT_IN = "doesn't have the security libraries"


def start_error(error: Exception) -> str:
    """The reason in one line why rclpy has not started a node; in words of its own where security is demanded.

    rcl's text for a missing keystore is empty, and that of a Fast DDS without security advises to compile it.
    """
    text = " ".join(str(error).split())
    if not demanded():
        return text
    if _NOT_BUILT_IN in text:
        return f"{ENABLE} is true, but this Fast DDS has no security: a ROS 2 installation has one, see docs/security.md"
    if not (keystore := os.environ.get(KEYSTORE)):
        return f"{ENABLE} is true, but {KEYSTORE} is not set: it takes the folder of a keystore, see docs/security.md"
    return f"{ENABLE} is true, but keystore {keystore} does not serve: {text}"


def demanded() -> bool:
    """Whether the environment demands security; rcl takes only this spelling."""
    return os.environ.get(ENABLE) == "true"
