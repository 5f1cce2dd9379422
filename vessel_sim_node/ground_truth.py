"""What no sensor measures, as messages: disturbance, unforced acceleration, and the true state where sensors are not perfect."""

from typing import Any

from geometry_msgs.msg import AccelStamped, WrenchStamped
from nav_msgs.msg import Odometry

from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_sim_node.plant import Wrench
from vessel_sim_node.simulator import Simulator


class GroundTruth:
    """Publishers of the ground truth, for which no node waits.

    Args:
        node: The plant's node.
        plant: The plant.
        profile: Quality of service of the topics.
    """

    def __init__(self, node: VesselNode, plant: Simulator, profile: Any) -> None:
        self._node, self._plant = node, plant
        self._disturbance_out = node.advertise(WrenchStamped, "disturbance", profile)
        self._dynamics_out = node.advertise(AccelStamped, "dynamics/truth", profile)
        self._disturbance, self._dynamics = node.framed(conversions.new_wrench()), node.framed(conversions.new_acceleration())
        if not plant.odometry_is_true:
            self._state_out = node.advertise(Odometry, "odom/truth", profile)
            self._state = node.framed(conversions.new_odometry())

    def publish(self, stamp: int, time: float) -> Wrench:
        """Publish the ground truth of a step.

        Args:
            stamp: Time of the step, ns.
            time: Time since the start, s.

        Returns:
            The disturbing wrench, N, N, N·m.
        """
        at = conversions.time_message(stamp)
        load = self._plant.disturbance(time)
        conversions.write_body_wrench(self._disturbance, at, load)
        self._node.send(self._disturbance_out, self._disturbance)
        conversions.write_acceleration(self._dynamics, at, self._plant.unforced_acceleration())
        self._node.send(self._dynamics_out, self._dynamics)
        if not self._plant.odometry_is_true:
            conversions.write_odometry(self._state, at, self._plant.state)
            self._node.send(self._state_out, self._state)
        return load
