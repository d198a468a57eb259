"""What a user of roslibpy does, in one process: its reactor cannot be started twice. Prints what came as JSON."""

import json
import queue
import sys
import time

import roslibpy

PORT = int(sys.argv[1])
WAIT = 10.0
seen = {}


def connected():
    ros = roslibpy.Ros(host="127.0.0.1", port=PORT)
    ros.run(timeout=WAIT)
    return ros


def first(topic, count=1):
    """The next messages of a topic."""
    messages = queue.Queue()
    topic.subscribe(messages.put)
    got = [messages.get(timeout=WAIT) for _ in range(count)]
    topic.unsubscribe()
    return got


def call(ros, name, type_name, request):
    return dict(roslibpy.Service(ros, name, type_name).call(roslibpy.ServiceRequest(request), timeout=WAIT))


ros, other = connected(), connected()
seen["imu"] = first(roslibpy.Topic(ros, "/wamv/sensors/imu/data", "sensor_msgs/Imu"))[0]
seen["relative"] = first(roslibpy.Topic(ros, "wamv/sensors/imu/data", "sensor_msgs/msg/Imu"))[0]["header"]["frame_id"]
begin = time.monotonic()
throttled = first(roslibpy.Topic(ros, "/clock", "rosgraph_msgs/Clock", throttle_rate=200), 4)
seen["throttled"] = {"seconds": time.monotonic() - begin, "clock": [m["clock"] for m in throttled]}
seen["image"] = first(roslibpy.Topic(ros, "/wamv/sensors/camera/image_raw", "sensor_msgs/Image"))[0]["data"]
seen["latched"] = first(roslibpy.Topic(other, "/vrx/task/info", "std_msgs/String"))[0]["data"]

thrust = roslibpy.Topic(ros, "/wamv/thrusters/left_thrust_cmd", "std_msgs/Float32")
thrust.publish(roslibpy.Message({"data": 5}))
roslibpy.Topic(ros, "/wamv/thruster/left", "std_msgs/Float32").publish(roslibpy.Message({"data": 1.0}))

talk, hear = (roslibpy.Topic(client, "/talk", "std_msgs/String") for client in (ros, other))
heard = queue.Queue()
hear.subscribe(heard.put)
call(other, "/rosapi/get_time", "rosapi/GetTime", {})  # so that the subscription has come before
talk.publish(roslibpy.Message({"data": "ahoy"}))
seen["talk"] = heard.get(timeout=WAIT)["data"]

seen["reset"] = call(ros, "/gazebo/reset_world", "std_srvs/Empty", {})
seen["fire"] = call(ros, "/wamv/fire", "std_srvs/Trigger", {})
try:
    call(ros, "/gazebo/delete_model", "gazebo_msgs/DeleteModel", {"model_name": "wamx"})
except roslibpy.core.ServiceException as error:
    seen["refused"] = str(error)


def add(request, response):
    response["sum"] = request["a"] + request["b"]
    return True


adder = roslibpy.Service(other, "/add", "rospy_tutorials/AddTwoInts")
adder.advertise(add)
call(other, "/rosapi/get_time", "rosapi/GetTime", {})
seen["sum"] = {}
answered = queue.Queue()
roslibpy.Service(ros, "/add", "rospy_tutorials/AddTwoInts").call(
    roslibpy.ServiceRequest({"a": 2, "b": 40}), answered.put, answered.put
)
seen["sum"] = dict(answered.get(timeout=WAIT))
adder.unadvertise()

parameter = roslibpy.Param(ros, "speed")
parameter.set({"limit": 2.5})
seen["parameter"] = roslibpy.Param(other, "/speed").get()
seen["table parameter"] = roslibpy.Param(ros, "/wamv/gains").get()
parameter.delete()
seen["parameters"] = ros.get_params()

seen["topics"] = ros.get_topics()
seen["topic type"] = ros.get_topic_type("/wamv/cmd_vel")
seen["topics for type"] = ros.get_topics_for_type("std_msgs/Float32")
seen["services"] = ros.get_services()
seen["service type"] = ros.get_service_type("/wamv/fire")
seen["services for type"] = ros.get_services_for_type("std_srvs/Empty")
seen["request"] = ros.get_service_request_details("gazebo_msgs/DeleteModel")["typedefs"]
seen["response"] = ros.get_service_response_details("std_srvs/Trigger")["typedefs"]
seen["message"] = ros.get_message_details("sensor_msgs/Imu")["typedefs"]
seen["nodes"] = ros.get_nodes()
seen["node"] = ros.get_node_details("/gazebo")
seen["time"] = dict(ros.get_time())
servers = queue.Queue()
ros.get_action_servers(servers.put)
seen["action servers"] = servers.get(timeout=WAIT)
print(json.dumps(seen, default=dict), flush=True)
other.close()
ros.close()
ros.terminate()
