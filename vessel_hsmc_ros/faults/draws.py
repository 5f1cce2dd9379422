"""Random numbers as a pure function of what they are for: same seed, same faults, whatever the order of the messages."""

import hashlib


def draw(seed: int, fault: int, topic: str, number: int, purpose: str) -> float:
    """A number uniform in [0, 1).

    Args:
        seed: Of the script.
        fault: Index of the fault in the script.
        topic: The topic of the message.
        number: Sequence number of the message on its topic.
        purpose: What the number decides.
    """
    text = f"{seed} {fault} {topic} {number} {purpose}".encode()
    return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "big") / 2.0**64
