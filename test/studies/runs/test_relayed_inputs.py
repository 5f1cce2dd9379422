"""Whether scripted faults have left the inputs of a controller as they were, from which its commands can be recomputed."""

from collections.abc import Callable
from pathlib import Path

import pytest
from bag_making import TYPES, made_run, topic

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.topics import RELAYED
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.verification import verify

STEPS = 12

Alter = Callable[[list[bytes]], list[bytes]]

ALTERED: dict[str, Alter] = {
    "a changed value": lambda sent: [*sent[:5], bytes([*sent[5][:-1], sent[5][-1] ^ 1]), *sent[6:]],
    "a dropped message": lambda sent: sent[:5] + sent[6:],
    "a repeated message": lambda sent: [*sent[:6], *sent[5:]],
    "exchanged messages": lambda sent: [*sent[:5], sent[6], sent[5], *sent[7:]],
    "the first dropped": lambda sent: sent[1:],
}
UNALTERED: dict[str, Alter] = {"nothing": lambda sent: sent, "the last not relayed any more": lambda sent: sent[:-1]}


def relayed(folder: Path, name: str, alter: Alter) -> Path:
    """A bag of two vessels with a relay, which alters one topic of the first one."""
    writer = BagWriter(folder / "bag")
    for vessel in ("alpha", "beta"):
        for each in ("odom", "reference"):
            sent = [data for _, of, _, data in made_run(STEPS) if of == each]
            received = alter(sent) if (vessel, each) == ("alpha", name) else sent
            for prefix, messages in (("", sent), (RELAYED, received)):
                there = topic(f"/{vessel}/{prefix}{each}", TYPES[each])
                writer.add_topic(there)
                for k, data in enumerate(messages):
                    writer.write(there, data, k, k)
        wrench = topic(f"/{vessel}/cmd_wrench", TYPES["cmd_wrench"])
        writer.add_topic(wrench)
        if vessel == "alpha":  # a wrench that answers none of the odometry: nothing is computed
            writer.write(wrench, next(data for stamp, of, _, data in made_run(STEPS + 1)[::-1] if of == "cmd_wrench"), 0, 0)
    writer.close()
    return writer.directory


@pytest.mark.parametrize("name", ["odom", "reference"])
@pytest.mark.parametrize("alter", ALTERED.values(), ids=ALTERED)
def test_commands_that_answer_altered_inputs_are_not_recomputed(tmp_path: Path, name: str, alter: Alter) -> None:
    bag = open_bag(relayed(tmp_path, name, alter))
    with pytest.raises(BagError, match=rf"with faults on /alpha/{name}: its commands answer /alpha/{RELAYED}{name}"):
        verify(bag, load_scenario("case2_tracking", {"controller.lockstep": True}), "alpha")


@pytest.mark.parametrize("name", ["odom", "reference"])
@pytest.mark.parametrize("alter", UNALTERED.values(), ids=UNALTERED)
def test_inputs_that_the_relay_has_passed_on_as_they_were_are_no_obstacle(tmp_path: Path, name: str, alter: Alter) -> None:
    bag = open_bag(relayed(tmp_path, name, alter))
    with pytest.raises(BagError, match="no command that answers an odometry message"):
        verify(bag, load_scenario("case2_tracking", {"controller.lockstep": True}), "alpha")
