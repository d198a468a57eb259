"""A planner: it waits for the goal, which is latched, and says once, latched too, where the team's beacon is."""

import rospy
from geographic_msgs.msg import GeoPoseStamped

rospy.init_node("planner")
goal = rospy.wait_for_message("/vrx/station_keeping/goal", GeoPoseStamped, timeout=60)
beacon = rospy.Publisher("/team/beacon", GeoPoseStamped, queue_size=1, latch=True)
goal.header.frame_id = "beacon"
beacon.publish(goal)
print("ready", flush=True)
rospy.spin()
