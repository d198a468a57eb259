"""A stand-in for ArduPilot's SITL: its packets as the protocol's page has them, and its reader's way with answers.

Typed from libraries/SITL/examples/JSON/readme.md and the table of keys in SIM_JSON.h of ArduPilot, not from our
encoder.
"""

import math
import socket

__all__ = ["FakeSitl", "helm", "packet", "values"]

SECTIONS = {
    "timestamp": ("", 1), "gyro": ("imu", 3), "accel_body": ("imu", 3), "position": ("", 3), "velocity": ("", 3),
    "quaternion": ("", 4), "direction": ("windvane", 1), "speed": ("windvane", 1),
}  # fmt: skip
"""Keys that ArduPilot looks for, with the section in which they are and how many numbers they have."""


def packet(count, pulses=(1500,) * 16, *, rate=50, magic=None):
    """A packet of servo outputs: magic, rate, number of the frame and pulses, little-endian."""
    magic = {16: 18458, 32: 29569}[len(pulses)] if magic is None else magic
    words = [(magic, 2), (rate, 2), (count, 4), *((pulse, 2) for pulse in pulses)]
    return b"".join(value.to_bytes(size, "little") for value, size in words)


def values(line):
    """The numbers that ArduPilot takes from a line: it looks for the first place of a section, and then of a key."""
    assert line.startswith("\n")
    assert line.endswith("\n")
    assert line.count("\n") == 2
    found = {}
    for key, (section, count) in SECTIONS.items():
        begin = line.find(section)
        assert begin >= 0, section
        begin = line.find(key, begin + len(section))
        assert begin >= 0, key
        text = line[begin + len(key) + 2 :]  # after the quote and the colon: sscanf takes no blank before "["
        assert count == 1 or text[0] == "[", text[:20]
        numbers = text[1 : text.index("]")] if count > 1 else text.split(",")[0].split("}")[0]
        found[key] = [float(number) for number in numbers.split(",")]
        assert len(found[key]) == count
    return found


class FakeSitl:
    """One autopilot, which sends frames and waits for answers."""

    def __init__(self, address, *, rate=50):
        self.address, self.rate, self.count, self.last = address, rate, 0, None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(5.0)

    def send(self, pulses=(1500,) * 16):
        """Send the next frame."""
        self.socket.sendto(packet(self.count, pulses, rate=self.rate), self.address)
        self.count += 1

    def repeat(self, pulses=(1500,) * 16):
        """Send the last frame again, as SITL does when an answer does not come."""
        self.socket.sendto(packet(self.count - 1, pulses, rate=self.rate), self.address)

    def asked(self, pulses=(1500,) * 16):
        """The answer to the next frame, which is sent again until it comes, as SITL does."""
        self.send(pulses)
        self.socket.settimeout(0.2)
        for _ in range(300):
            try:
                answer = self.receive()
            except (TimeoutError, ConnectionError):
                self.repeat(pulses)
                continue
            if answer["timestamp"] != self.last:
                self.last = answer["timestamp"]
                return answer
        raise TimeoutError(self.address)

    def receive(self):
        """The numbers of the answer that comes next."""
        return values(self.socket.recv(65000).decode())

    @property
    def is_answered(self):
        """Whether an answer is there already."""
        self.socket.setblocking(False)
        try:
            return bool(self.socket.recv(65000, socket.MSG_PEEK))
        except BlockingIOError:
            return False
        finally:
            self.socket.settimeout(5.0)

    def close(self):
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def helm(answer, waypoint):
    """Pulses of a skid-steered boat that heads for a waypoint (north, east) [m], and its distance [m]."""
    north, east = (goal - here for goal, here in zip(waypoint, answer["position"], strict=False))
    w, x, y, z = answer["quaternion"]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    off = math.remainder(math.atan2(east, north) - yaw, 2.0 * math.pi)
    turn = max(-1.0, min(1.0, 1.5 * off - 1.0 * answer["gyro"][2]))
    throttle = 0.8 * max(0.0, math.cos(off))
    left, right = (round(1500 + 400 * max(-1.0, min(1.0, throttle + side * 0.5 * turn))) for side in (1.0, -1.0))
    return (left, 1500, right, *(1500,) * 13), math.hypot(north, east)
