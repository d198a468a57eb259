"""A rosbridge server before a table that stands for a simulation, whose thread answers calls and takes commands."""

import contextlib
import threading

import numpy as np

from vrx_mj.errors import CommandError
from vrx_mj.ros import messages
from vrx_mj.ros.graph import Graph, Wires
from vrx_mj.ros.interface import Delivery, Inbox, Input, Output, RosInterface, Service
from vrx_mj.ros.network import Network
from vrx_mj.ros.rosbridge import Rosbridge

COVARIANCE = [0.5, 0.0, float("nan"), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
PIXELS = np.arange(24, dtype=np.uint8)


def nothing(_message=None):
    return None


def table():
    outputs = [
        Output("/clock", "rosgraph_msgs/Clock", nothing),
        Output("/wamv/sensors/imu/data", "sensor_msgs/Imu", nothing),
        Output("/wamv/sensors/camera/image_raw", "sensor_msgs/Image", nothing),
        Output("/wamv/joint_states", "sensor_msgs/JointState", nothing),
        Output("/vrx/task/info", "std_msgs/String", nothing, latched=True),
        Output("/wind/speed", "std_msgs/Float64", nothing),
    ]
    inputs = [
        Input("/wamv/thrusters/left_thrust_cmd", "std_msgs/Float32", nothing),
        Input("/wamv/cmd_vel", "geometry_msgs/Twist", nothing),
    ]
    services = [
        Service("/gazebo/reset_world", "std_srvs/Empty", lambda _: None),
        Service("/wamv/fire", "std_srvs/Trigger", fire),
        Service("/gazebo/delete_model", "gazebo_msgs/DeleteModel", delete),
    ]
    return RosInterface(
        {output.name: output for output in outputs},
        {entry.name: entry for entry in inputs},
        {service.name: service for service in services},
        {"/use_sim_time": True, "/wamv/robot_description": "<robot/>", "/wamv/gains": {"p": 1.5, "limits": [1, 2]}},
    )


def fire(_request):
    return {"success": True, "message": "away"}


def delete(request):
    if request.model_name != "wamv":
        raise CommandError(f"no model named '{request.model_name}'; known: wamv")
    return {"success": True, "status_message": "gone"}


def imu(seq=0, time=1.5):
    return messages.new(
        "sensor_msgs/Imu",
        header={"seq": seq, "stamp": messages.stamp(time), "frame_id": "wamv/imu_link"},
        orientation={"w": 1.0},
        orientation_covariance=np.array(COVARIANCE),
    )


def image(pixels=PIXELS, width=4):
    return messages.new(
        "sensor_msgs/Image",
        height=len(pixels) // (3 * width),
        width=width,
        encoding="rgb8",
        step=3 * width,
        data=pixels,
    )


class Bridged:
    """The server and what stands for the simulation; `came` and `unknown_publishers` are what clients sent."""

    def __init__(self, port=0, host="127.0.0.1", origins=()):
        self.table = table()
        self.inbox = Inbox()
        self.network = Network()
        self.graph = Graph(self.network, self.inbox)
        self.bridge = Rosbridge(self.graph, port=port, host=host, origins=origins)
        self.wires = Wires(self.graph, [self.bridge])
        self.came, self.unknown_publishers = [], []
        self.silent = False
        self._changed = threading.Condition()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        try:
            self.lines = self.wires.start()
        except BaseException:
            self.network.close()
            raise
        self.wires.offer(self.table)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self.wires.close()
        self.network.close()
        self._thread.join(5.0)

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.bridge.port}"

    def send(self, name, message, time=1.5):
        self.wires.publish([Delivery(self.table.outputs[name], message, time)])

    def wait(self, what, seconds=5.0):
        """Wait until a condition holds."""
        with self._changed:
            assert self._changed.wait_for(lambda: what(self), seconds), "it took too long"

    def _run(self):
        while not self._over.is_set():
            self.inbox.wait(0.01)
            commands, calls, unknown_publishers = self.inbox.drain()
            for call in calls:
                self._answer(call)
            with self._changed:
                self.came += [(command.topic, command.message) for command in commands]
                self.unknown_publishers += unknown_publishers
                self._changed.notify_all()

    def _answer(self, call):
        if self.silent:
            return
        try:
            call.answer(self.table.services[call.service].answer(call.request), "")
        except CommandError as error:
            call.answer(None, str(error))


@contextlib.contextmanager
def publishing(bridged, make, rate=50.0):
    """Have messages made and sent all the time, as long as somebody wants them: `make(time)` by topic."""
    over = threading.Event()

    def run():
        step = 0
        while not over.wait(1.0 / rate):
            step += 1
            time = step / rate
            wanted = bridged.wires.subscribed_topics
            batch = [Delivery(bridged.table.outputs[n], f(time), time) for n, f in make.items() if n in wanted]
            bridged.wires.publish(batch)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(5.0)
