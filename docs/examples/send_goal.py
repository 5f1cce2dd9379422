"""Send the ship somewhere: one goal pose, published as RViz or any planner would.

vessel-hsmc run goal --real-time --set reference_ship.goal.times=[-1,-1]   # in one terminal: no goals of its own
python docs/examples/send_goal.py 40 20 1.57                               # in another, with the same ROS_DOMAIN_ID
"""

import math
import sys

import rclpy
from geometry_msgs.msg import PoseStamped


def main(x: float, y: float, heading: float) -> None:
    """Wait until every reader is connected, publish the goal, wait until they have it."""
    rclpy.init()
    node = rclpy.create_node("goal_sender")
    publisher = node.create_publisher(PoseStamped, "goal_pose", 10)
    while not 0 < node.count_subscribers("goal_pose") <= publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.05)
    goal = PoseStamped()
    goal.header.frame_id = "odom"
    goal.header.stamp = node.get_clock().now().to_msg()
    goal.pose.position.x, goal.pose.position.y = x, y
    goal.pose.orientation.z, goal.pose.orientation.w = math.sin(0.5 * heading), math.cos(0.5 * heading)
    publisher.publish(goal)
    publisher.wait_for_all_acked()
    rclpy.shutdown()


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:4]))
