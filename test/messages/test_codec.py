"""Serialised messages against rclpy's: any message of the loop is written with its bytes and read with its values."""

from array import array
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from durations import rest_long
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.msg import ParameterValue
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, JointState, NavSatFix
from std_msgs.msg import Float64
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.messages.codec import Decoder, Encoder, decoder, encoder
from vessel_hsmc_ros.messages.raw import message_class

KINDS = (
    *(Odometry, WrenchStamped, PoseStamped, TwistStamped, AccelStamped, Clock, Float64, ControlState, ReferenceState),
    *(NavSatFix, BatteryState),
)
FLOATS = st.floats(width=64)
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "double": FLOATS,
    "double[36]": st.lists(FLOATS, min_size=36, max_size=36),
    "sequence<double>": st.lists(FLOATS, max_size=9).map(lambda values: array("d", values)),
    "string": st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20),
    "float": st.floats(width=32),
    "sequence<float>": st.lists(st.floats(width=32), max_size=5).map(lambda values: array("f", values)),
    "double[9]": st.lists(FLOATS, min_size=9, max_size=9),
    "boolean": st.booleans(),
    "int8": st.integers(-(2**7), 2**7 - 1),
    "uint16": st.integers(0, 2**16 - 1),
    "uint8": st.integers(0, 2**8 - 1),
    "uint64": st.integers(0, 2**64 - 1),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint32": st.integers(0, 2**32 - 1),
}


@st.composite
def messages(draw: st.DrawFn, kind: Any) -> Any:
    """A message of a type with drawn values in all its fields."""
    message = kind()
    for field, name in kind.get_fields_and_field_types().items():
        nested = name.replace("/", "/msg/")
        setattr(message, field, draw(messages(message_class(nested)) if "/" in name else VALUES[name]))
    return message


def leaves(message: Any) -> Any:
    """The values of a message, whatever its classes are; those of floats as text, so that NaN equals itself."""
    fields = getattr(message, "get_fields_and_field_types", dict)() or getattr(message, "_fields", ())
    if fields:
        return [leaves(getattr(message, field)) for field in fields]
    return [repr(float(x)) for x in message] if hasattr(message, "__len__") and not isinstance(message, str) else repr(message)


@pytest.mark.parametrize("kind", rest_long(KINDS), ids=lambda kind: kind.__name__)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_a_message_is_written_and_read_as_by_rclpy(kind: Any, data: st.DataObject) -> None:
    encode = Encoder(kind)
    for message in (data.draw(messages(kind)), data.draw(messages(kind))):  # of other lengths of texts
        written = encode(message)
        assert leaves(deserialize_message(written, kind)) == leaves(message)
        assert len(written) <= len(serialize_message(message))  # rclpy reserves bytes for the alignment of empty lists
        if read := decoder(kind):
            assert leaves(read(serialize_message(message))) == leaves(message)


def test_the_bytes_between_the_fields_are_zero() -> None:
    message = WrenchStamped()
    message.header.frame_id = "a/base_link"  # 12 bytes with its end: none is between it and the numbers
    assert Encoder(WrenchStamped)(message) == serialize_message(message)
    message.header.frame_id = "a"
    assert Encoder(WrenchStamped)(message)[18:20] == b"\0\0"


def test_types_with_other_lists_are_left_to_rclpy() -> None:
    for kind in (Path, DiagnosticStatus, ParameterValue, JointState):
        assert encoder(kind) is None
        assert decoder(kind) is None
    assert encoder(ControlState) is not None
    assert decoder(ControlState) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data[:-1],
        lambda data: data + b"\0" * 4,
        lambda data: data[:1] + b"\0" + data[2:],  # the other order of bytes
        lambda data: data[:12] + b"\xff" * 4 + data[16:],
        lambda data: data[:12] + bytes(4) + data[16:],
        lambda data: data[:0],
    ],
)
@pytest.mark.parametrize("expected", [True, False])
def test_bytes_of_another_form_are_refused(change: Any, expected: bool) -> None:
    message = Odometry()
    message.header.frame_id, message.child_frame_id = "odom", "base_link"
    data, read = serialize_message(message), Decoder(Odometry)
    if expected:
        read(data)
    with pytest.raises(ValueError, match=r"another form|longer than the message"):
        read(change(data))
    assert read(data).child_frame_id == "base_link"
