"""A stack that was written for all tasks: whatever the world, it advertises and subscribes to the topics of each."""

import rospy
from geographic_msgs.msg import GeoPath, GeoPoseStamped
from geometry_msgs.msg import Vector3
from std_msgs.msg import Empty, Float32, Float64, Float64MultiArray, String
from usv_msgs.msg import RangeBearing
from vrx_gazebo.msg import Contact, Task
from vrx_gazebo.srv import ColorSequence

rospy.init_node("whole_stack")
thrust = [rospy.Publisher(f"/wamv/thrusters/{side}_thrust_cmd", Float32, queue_size=1) for side in ("left", "right")]
published = [
    rospy.Publisher("/vrx/perception/landmark", GeoPoseStamped, queue_size=1),
    rospy.Publisher("/wamv/shooters/ball_shooter/fire", Empty, queue_size=1),
    rospy.Publisher("/wamv/sensors/pingers/pinger/set_pinger_position", Vector3, queue_size=1),
]
colors = rospy.ServiceProxy("/vrx/scan_dock_deliver/color_sequence", ColorSequence)
heard = {}


def listen(topic, kind):
    """Count the messages of a topic."""
    rospy.Subscriber(topic, kind, lambda _: heard.__setitem__(topic, heard.get(topic, 0) + 1))


for name, kind in (
    ("/vrx/task/info", Task),
    ("/vrx/debug/contact", Contact),
    ("/vrx/station_keeping/goal", GeoPoseStamped),
    ("/vrx/station_keeping/pose_error", Float64),
    ("/vrx/wayfinding/waypoints", GeoPath),
    ("/vrx/wayfinding/min_errors", Float64MultiArray),
    ("/vrx/wildlife/animals/poses", GeoPath),
    ("/vrx/scan_dock/placard_symbol", String),
    ("/vrx/gymkhana_channel/task/info", Task),
    ("/vrx/gymkhana_blackbox/goal", GeoPoseStamped),
    ("/wamv/sensors/pingers/pinger/range_bearing", RangeBearing),
):
    listen(name, kind)
rate = rospy.Rate(10)
while not thrust[0].get_num_connections() or "/vrx/station_keeping/goal" not in heard:
    rate.sleep()
print("ready", flush=True)
while not rospy.is_shutdown():
    for one in thrust:
        one.publish(0.2)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
print("heard", *sorted(heard), flush=True)
