"""A dock, a boat and a ball for tests of the docking tasks."""

import numpy as np

from unit.tasks.streams import frame, pose, task
from vrx_mj.tasks.dock import Docking
from vrx_mj.tasks.referee import Pose

BALL = "wamv/ball_shooter"
FAR = (0.0, 0.0, -200.0)
"""Where a ball is parked."""
ZONES = {
    "dock_2018": [
        # internal centre and size, external centre and size
        ((12.5, 3.0, 0.35), (1.5, 4.0, 2.0), (17.5, 3.0, 0.35), (1.5, 8.0, 2.0)),
        ((1.5, 3.0, 0.35), (1.5, 4.0, 2.0), (-2.5, 3.0, 0.35), (1.5, 8.0, 2.0)),
    ],
    "dock_2022": [
        ((1.45, y, 0.25), (4.0, 1.5, 2.0), (-3.55, y, 0.25), (1.5, 5.5, 2.0))  # GC
        for y in (3.0, 9.0, 15.0)
    ],
    "dock_2022_of_2023": [
        ((1.5, y, 0.25), (4.0, 1.5, 2.0), (-3.5, y, 0.25), (1.5, 5.5, 2.0))  # JZ
        for y in (3.0, 9.0, 15.0)
    ],
}
"""VRX's bay zones in the dock's frame [m]."""
HOLES = [
    {"bay": f"bay{i + 1}", "size": size, "points": points, "center": [5.95, 3.0 + 6.0 * i + aside, 2.83], "box": box}
    for i in range(3)
    for size, points, aside, box in (("big", 5.0, 0.6, [0.5, 0.5, 0.5]), ("small", 10.0, -0.6, [0.5, 0.25, 0.25]))
]
"""Of dock_2022; the boxes are x by y by z in the dock's frame."""
BAY, OUT, AWAY = (1.45, 9.0, 0.0), (-3.55, 9.0, 0.0), (-20.0, 9.0, 0.0)
"""Places of the boat by dock_2022: in bay 2, before it, and off."""


def docking(dock="dock_2022", right=(2,), **values):
    bays = [
        {
            "name": f"bay{number}",
            "placard": f"placard{number}",
            "symbol": ("red_circle", "blue_triangle", "yellow_cross")[number - 1],
            "dock_allowed": number in right,
            "internal": {"center": list(internal), "size": list(size)},
            "external": {"center": list(external), "size": list(extent)},
        }
        for number, (internal, size, external, extent) in enumerate(ZONES[dock], start=1)
    ]
    parameters = {
        "dock": "dock",
        "anchor": "dock",
        "bays": bays,
        "holes": HOLES,
        "balls": [BALL],
        "light_buoy": "light_buoy",
        "color_sequence": ["red", "green", "blue"],
        "color_bonus_points": 10.0,
        "dock_bonus_points": 15.0,
        "correct_dock_bonus_points": 5.0,
        "enable_color_checker": True,
        "min_dock_time": 10.0,
    }
    row = task("scan_dock_deliver", **(parameters | values))
    return Docking(row)


class Run:
    """A run of a boat and a ball, whose places are given in the dock's frame."""

    def __init__(self, referee, dock=None, boat=AWAY, start=0.0):
        self.referee, self.dock, self.boat, self.ball, self.time = referee, dock or pose(), boat, FAR, start
        self.lines, self.actions = [], []
        if referee.status.running_time == 0.0:
            self.go(0.0)
            self.go()
            assert referee.status.phase == "running"

    def go(self, seconds=0.05, boat=None, ball=None, dock=None, others=(), **values):
        """One frame, some time after the one before."""
        self.boat, self.ball = boat or self.boat, ball or self.ball
        self.dock, self.time = dock or self.dock, self.time + seconds
        poses = {"dock": self.dock, BALL: self.place(self.ball), **{name: self.place(at) for name, at in others}}
        verdict = self.referee.look(frame(self.time, self.place(self.boat), **poses, **values))
        self.lines += [line for line, _ in verdict.lines if not line.startswith("scan_dock_deliver: ")]
        self.actions += verdict.actions
        return self

    def stay(self, seconds, boat):
        """Frames at 20 Hz for some time, the boat being somewhere."""
        for _ in range(round(seconds * 20)):
            self.go(boat=boat)
        return self

    def place(self, point):
        """Where in the world a point of the dock's frame is."""
        w, x, y, z = self.dock.quaternion
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        return Pose(*(turn @ point + (self.dock.x, self.dock.y, self.dock.z)).tolist())

    @property
    def score(self):
        return self.referee.status.score

    @property
    def over(self):
        return self.referee.is_over

    @property
    def progress(self):
        return self.referee.progress
