"""Survey a rectangle by latitude and longitude with running nodes; Ctrl-C cancels, and the vessel keeps station.

vessel-hsmc run waypoints --real-time --set vessel_sim.duration=0 --set reference_ship.path.time=-1 \
    --set reference_ship.actions.datum=[63.44,10.39]        # the nodes, in one terminal; Ctrl-C there ends the run
python examples/survey_by_position.py 63.4401 10.3905 60 40 20   # corner, length to the east, width to the north, spacing
vessel-hsmc report runs/*/bag                               # the page: track, errors, what was commanded
"""

import sys

import rclpy
from rclpy.action import ActionClient
from rclpy.signals import SignalHandlerOptions
from vessel_hsmc_msgs.action import FollowGPSWaypoints  # with Nav2: from nav2_msgs.action
from vessel_hsmc_msgs.msg import GeoPoint, GeoPose  # with Nav2: from geographic_msgs.msg

from vessel_hsmc_ros.core.kinematics import Plane


def legs(latitude: float, longitude: float, length: float, width: float, spacing: float) -> list[GeoPose]:
    """The ends of parallel legs, there and back."""
    rows = range(round(width / spacing) + 1)
    ends = [(x, spacing * row) for row in rows for x in ((0.0, length) if row % 2 == 0 else (length, 0.0))]
    places = [Plane(latitude, longitude).coordinates(x, y) for x, y in ends]
    return [GeoPose(position=GeoPoint(latitude=north, longitude=east)) for north, east in places]


def main(*rectangle: float) -> int:
    """Send the survey, show its progress, and wait for the end."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # rclpy's would end the context before the cancel is sent
    node = rclpy.create_node("surveyor")
    client = ActionClient(node, FollowGPSWaypoints, "follow_gps_waypoints")
    client.wait_for_server()
    goal = FollowGPSWaypoints.Goal(gps_poses=legs(*rectangle))

    def show(message: FollowGPSWaypoints.Impl.FeedbackMessage) -> None:
        print(f"waypoint {message.feedback.current_waypoint}, {message.feedback.distance_remaining:.0f} m left")

    sent = client.send_goal_async(goal, show)
    rclpy.spin_until_future_complete(node, sent)
    ended = sent.result().get_result_async()
    try:
        rclpy.spin_until_future_complete(node, ended)
    except KeyboardInterrupt:
        rclpy.spin_until_future_complete(node, sent.result().cancel_goal_async())
        return 130
    print(ended.result().result.error_msg)
    return int(ended.result().result.error_code != FollowGPSWaypoints.Result.NONE)


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:6])))
