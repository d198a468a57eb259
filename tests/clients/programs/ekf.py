"""A filter over GPS and IMU as teams have it: frames by tf, places by fromLL; it ends where time does not go on."""

import math

import rospy
import tf2_ros
from geographic_msgs.msg import GeoPoint
from nav_msgs.msg import Odometry
from robot_localization.srv import FromLL
from sensor_msgs.msg import Imu, NavSatFix

rospy.init_node("ekf")
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
rospy.wait_for_service("/fromLL", timeout=60)
from_degrees = rospy.ServiceProxy("/fromLL", FromLL, persistent=True)
state, latest, apart, seen = {}, {}, [], {"fixes": 0, "future": 0}


def predict(now):
    """Carry the position on by the velocity, and its variance by that of the acceleration."""
    dt = now - state["time"]
    if dt <= 0.0:
        rospy.signal_shutdown(f"time does not go on: dt = {dt}")
        raise ZeroDivisionError(f"dt = {dt}")
    state["time"], state["place"] = now, [p + dt * v for p, v in zip(state["place"], state["velocity"], strict=True)]
    state["variance"] += (2.0 * dt) ** 2
    return dt


def on_fix(fix):
    """Correct by a fix, whose antenna's place on the boat is asked of tf, and turned by the IMU's heading."""
    if "imu" not in latest:
        return
    now, q = fix.header.stamp.to_sec(), latest["imu"].orientation
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y**2 + q.z**2))
    point = from_degrees(GeoPoint(fix.latitude, fix.longitude, fix.altitude)).map_point
    antenna = buffer.lookup_transform("wamv/base_link", fix.header.frame_id, rospy.Time(0), rospy.Duration(1.0))
    arm = antenna.transform.translation
    place = [point.x - math.cos(yaw) * arm.x + math.sin(yaw) * arm.y,
             point.y - math.sin(yaw) * arm.x - math.cos(yaw) * arm.y]  # fmt: skip
    if "time" not in state:
        state.update(time=now, place=place, velocity=[0.0, 0.0], variance=1.0)
        return
    dt = predict(now)
    weight = state["variance"] / (state["variance"] + 0.01)
    misses = [there - here for there, here in zip(place, state["place"], strict=True)]
    state["place"] = [p + weight * miss for p, miss in zip(state["place"], misses, strict=True)]
    state["velocity"] = [v + 0.5 * miss / dt for v, miss in zip(state["velocity"], misses, strict=True)]
    state["variance"] *= 1.0 - weight
    seen["fixes"] += 1


def on_odometry(odometry):
    latest["odometry"] = odometry.pose.pose.position
    if seen["fixes"] > 10:
        at = latest["odometry"]
        apart.append(math.hypot(at.x - state["place"][0], at.y - state["place"][1]))


rospy.Subscriber("/wamv/sensors/gps/gps/fix", NavSatFix, on_fix, queue_size=1)
rospy.Subscriber("/wamv/sensors/imu/imu/data", Imu, lambda imu: latest.update(imu=imu), queue_size=1)
rospy.Subscriber("/wamv/robot_localization/odometry/filtered", Odometry, on_odometry, queue_size=1)
while not rospy.is_shutdown() and (seen["fixes"] < 5 or len(latest) < 2):
    rospy.sleep(0.1)
print("ready", flush=True)
while not rospy.is_shutdown():
    try:
        found = buffer.lookup_transform("map", "wamv/base_link", rospy.Time(0)).transform.translation
        later = rospy.Time.now() + rospy.Duration(60.0)
        try:
            buffer.lookup_transform("map", "wamv/base_link", later, rospy.Duration(0.1))
        except tf2_ros.ExtrapolationException:
            seen["future"] += 1
        rospy.sleep(0.2)
    except rospy.ROSInterruptException:
        break
print("fixes", seen["fixes"], "future", seen["future"], "apart", max(apart), flush=True)
print("tf", found.x, found.y, "at", latest["odometry"].x, latest["odometry"].y, flush=True)
