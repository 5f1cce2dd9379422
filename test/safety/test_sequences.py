"""Many random sequences of messages, law values and operator commands, and the properties that hold in all of them."""

from hypothesis import given, settings
from hypothesis import strategies as st
from safety_sequences import drive

from vessel_hsmc_ros.safety.reasons import Reason


@settings(max_examples=800)
@given(st.binary(min_size=21, max_size=81))
def test_every_sequence_of_messages_gives_finite_bounded_commands_and_leads_back_to_the_law(data: bytes) -> None:
    drive(data)


def test_the_sequences_reach_every_reason_of_a_refusal() -> None:
    refused: set[Reason] = set()
    for seed in range(60):
        machine = drive(bytes((7 * seed + 31 * i + i * i * (seed + 1)) % 256 for i in range(161)))
        refused |= {reason for each in machine.inputs for reason in each.fresh.refused}
    assert refused == {
        Reason.STAMP_OLD,
        Reason.STAMP_FUTURE,
        Reason.DUPLICATE,
        Reason.OUT_OF_ORDER,
        Reason.WRONG_FRAME,
        Reason.NOT_FINITE,
        Reason.UNCERTAIN,
    }
