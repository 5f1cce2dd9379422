"""A plant and its reference ship, as the controller sees them."""

import numpy as np
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos

STEP = 10_000_000
STATE = np.array([5.0, 1.0, 0.5, 0.3, 0.1, 0.02])
REFERENCE = np.array([5.5, 1.2, 0.45, 0.4, 0.0, 0.01])
ACCELERATION = np.array([0.1, 0.0, 0.01])


class Plant:
    """Sends odometry and reference as plant and reference ship would."""

    def __init__(self, bench, lockstep=True):
        self.bench = bench
        profile = qos.data(lockstep)
        self.odometry = bench.publisher(Odometry, "odom", lockstep)
        self.reference = bench.publisher(ReferenceState, "reference", lockstep)
        self.commands = bench.collect(WrenchStamped, "cmd_wrench", profile)
        self.states = bench.collect(ControlState, "controller/state", profile)

    def send_odometry(self, stamp, state=STATE):
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(stamp), np.asarray(state))
        self.odometry.publish(message)

    def send_reference(self, stamp, state=REFERENCE, acceleration=ACCELERATION):
        message = conv.new_reference()
        conv.write_reference(message, conv.time_message(stamp), np.asarray(state), np.asarray(acceleration))
        self.reference.publish(message)

    def connect(self, node):
        self.bench.until(lambda: node.connected and self.odometry.get_subscription_count())
        return node

    def stamps(self):
        return [conv.nanoseconds(m.header.stamp) for m in self.commands]

    def now(self):
        return self.bench.probe.get_clock().now().nanoseconds
