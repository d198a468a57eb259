"""Our transport with a table of its own, and a node of rclpy before it; writes what both saw as JSON. Needs rclpy."""

import json
import statistics
import sys
import threading
import time

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosbags.typesys import get_types_from_msg
from sensor_msgs.msg import CameraInfo, Image, Imu
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import SetBool
from visualization_msgs.msg import MarkerArray

from vrx_mj.ros import cdr
from vrx_mj.ros.interface import Delivery, Inbox, Input, Output, RosInterface, Service
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros2 import Ros2
from vrx_mj.ros.table.host import header

LONGEST = 60.0
PIXELS = np.arange(6 * 4 * 3, dtype=np.uint8)
HEAD = header(12.5, "wamv/link")
MADE = {
    "/imu": new("sensor_msgs/Imu", header=HEAD, angular_velocity={"z": 0.25}),
    "/image": new("sensor_msgs/Image", header=HEAD, height=4, width=6, encoding="rgb8", step=18, data=PIXELS),
    "/info": new("sensor_msgs/CameraInfo", header=HEAD, D=np.array([0.5]), K=np.arange(9.0)),
    "/goal": new("geometry_msgs/PoseStamped", header=HEAD, pose={"position": {"x": -33.5, "y": 150.5}}),
    "/params": new("std_msgs/String", data="never"),
    "/markers": new("visualization_msgs/MarkerArray", markers=[new("visualization_msgs/Marker", header=HEAD, id=7)]),
}
TYPES = {
    "/imu": "sensor_msgs/Imu",
    "/image": "sensor_msgs/Image",
    "/info": "sensor_msgs/CameraInfo",
    "/goal": "geometry_msgs/PoseStamped",
    "/params": "ros_gz_interfaces/ParamVec",
    "/markers": "visualization_msgs/MarkerArray",
}
OUTPUTS = {
    name: Output(name, kind, lambda: None, latched=name in {"/goal", "/markers"}) for name, kind in TYPES.items()
}
SERVICE = "/world/bay/set"
SERVICES = {SERVICE: Service(SERVICE, "std_srvs/SetBool", lambda _: None)}
for half, text in (("Request", "bool data\n"), ("Response", "bool success\nstring message\n")):
    cdr.typestore().register(get_types_from_msg(text, f"std_srvs/msg/SetBool{half}"))
INPUTS = {
    "/wamv/thrusters/left/thrust": Input("/wamv/thrusters/left/thrust", "std_msgs/Float64", lambda _: None),
    "/fire": Input("/fire", "std_msgs/Bool", lambda _: None),
}


class Client:
    """A node that listens and publishes."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context)
        self.node = rclpy.create_node("client", context=self.context)
        self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.got = {}

    def listen(self, kind, topic, qos=10):
        return self.node.create_subscription(kind, topic, lambda one: self.got.setdefault(topic, one), qos)

    def until(self, condition, why):
        end = time.monotonic() + LONGEST
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(why)
            self.executor.spin_once(timeout_sec=0.02)

    def close(self):
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def send(ros2, *names):
    ros2.publish([Delivery(OUTPUTS[name], MADE[name], 12.5) for name in names])


def main():
    inbox = Inbox()
    ros2 = Ros2(inbox)
    told = {"lines": list(ros2.start())}
    ros2.offer(RosInterface(OUTPUTS, INPUTS, SERVICES))
    send(ros2, "/goal", "/markers")  # before anybody listens
    client = Client()
    told |= outputs(client, ros2)
    told["commands"] = commands(client, ros2, inbox)
    told["calls"] = calls(client, inbox)
    told["unknown_publishers"] = unknown_publishers(client, inbox)
    told["cost"] = cost(ros2, inbox)
    withdraw(client, ros2)
    told["topics in the end"] = [name for name in topics(client) if client.node.count_publishers(name)]
    told["clients"], told["sent"], told["dropped"] = ros2.traffic
    begun = time.monotonic()
    ros2.close()
    told["closing"] = time.monotonic() - begun
    client.close()
    told["threads"] = [thread.name for thread in threading.enumerate() if "vrx" in thread.name]
    json.dump(told, sys.stdout)


def outputs(client, ros2):
    client.until(lambda: client.node.count_publishers("/imu"), "the topic appears")
    told, got = {"wanted at first": sorted(ros2.subscribed_topics)}, client.got
    client.listen(Imu, "/imu")
    client.listen(Image, "/image", qos_profile_sensor_data)
    client.listen(CameraInfo, "/info", qos_profile_sensor_data)
    for kind, topic in ((PoseStamped, "/goal"), (MarkerArray, "/markers")):
        client.listen(kind, topic, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    client.until(
        lambda: ros2.subscribed_topics == OUTPUTS.keys() - {"/params"}, f"all are wanted, not {ros2.subscribed_topics}"
    )
    client.until(lambda: {"/goal", "/markers"} <= got.keys(), "the latched messages")

    def all_came():
        send(ros2, "/imu", "/image", "/info", "/params")
        return {"/imu", "/image", "/info"} <= got.keys()

    client.until(all_came, "messages")
    return told | {
        "wanted": sorted(ros2.subscribed_topics),
        "imu": [got["/imu"].angular_velocity.z, got["/imu"].header.frame_id],
        "stamp": [got["/imu"].header.stamp.sec, got["/imu"].header.stamp.nanosec],
        "image": [got["/image"].width, bytes(got["/image"].data).hex()],
        "info": [list(got["/info"].d), got["/info"].k.tolist()],
        "goal": [got["/goal"].pose.position.x, got["/goal"].pose.position.y],
        "markers": [[one.id, one.header.frame_id, one.mesh_file.filename] for one in got["/markers"].markers],
        "topics": topics(client),
    }


def topics(client):
    return sorted(name for name, _ in client.node.get_topic_names_and_types())


def commands(client, ros2, inbox):
    thrust = client.node.create_publisher(Float64, "/wamv/thrusters/left/thrust", 10)
    fire = client.node.create_publisher(Bool, "/fire", 10)
    both = (thrust, fire)
    client.until(lambda: all(one.get_subscription_count() for one in both), "somebody takes commands")
    client.until(lambda: all(ros2.publishers(one.topic_name) == ["/client"] for one in both), "the client's name")
    for value in (1.5, 2.5, 3.5):
        thrust.publish(Float64(data=value))
    fire.publish(Bool(data=True))
    came = []

    def all_came():
        came.extend([one.topic, one.message.data, one.sender, one.dialect] for one in inbox.drain()[0])
        return len(came) == 4

    client.until(all_came, f"commands, of which came {came}")
    return came


def calls(client, inbox):
    """What a client got that was answered, and that failed."""
    asking = client.node.create_client(SetBool, SERVICE)
    client.until(asking.service_is_ready, "the service")
    told = []
    for answer in (lambda data: (cdr.kind("std_srvs/SetBoolResponse")(success=data, message="set"), ""),
                   lambda _: (None, "it failed")):  # fmt: skip
        done = asking.call_async(SetBool.Request(data=True))

        def is_done(answer=answer, done=done):
            for call in inbox.drain()[1]:
                told.append([call.service, call.request.data])
                call.answer(*answer(call.request.data))
            return done.done()

        client.until(is_done, "a response")
        told.append([done.result().success, done.result().message])
    return told


def unknown_publishers(client, inbox):
    client.node.create_publisher(String, "/wamv/thrusters/left/thurst", 10)
    came = []

    def appeared():
        came.extend(list(one) for one in inbox.drain()[2] if "thurst" in one.topic)
        return came

    client.until(appeared, "a publisher that nobody listens to")
    return came[0]


def cost(ros2, inbox):
    """Of a call of `publish` [s]: the median, with a moment between two as in a simulation."""
    spent = []
    for _ in range(200):
        begun = time.perf_counter()
        send(ros2, "/imu", "/image", "/info")
        spent.append(time.perf_counter() - begun)
        inbox.wait(0.002)
    return statistics.median(spent)


def withdraw(client, ros2):
    kept = {name: OUTPUTS[name] for name in ("/goal", "/image")}
    ros2.offer(RosInterface(kept, {}))
    client.until(lambda: not client.node.count_publishers("/imu"), "a topic is withdrawn")
    client.until(lambda: not client.node.count_subscribers("/fire"), "an input is withdrawn")


if __name__ == "__main__":
    main()
