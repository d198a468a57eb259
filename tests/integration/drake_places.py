"""What Drake's Parser, with libsdformat inside, makes of models: `python drake_places.py FILE...` prints JSON.

It runs with Drake's own Python. Each file gives the links' masses, places and inertia, and the joints that move,
in the frame of the model, or of the world for a world.
"""

import json
import logging
import os
import sys
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, JointIndex


def places(file: Path) -> dict[str, object]:
    """Links and joints of one file, and the groups of links that fixed joints hold together."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    os.chdir(file.parent.parent)  # where libsdformat finds the models that it includes
    instances = parser.AddModels(str(file))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    model = plant.GetFrameByName("__model__", instances[0])
    whole = model.CalcPoseInWorld(context).inverse()
    bodies = [plant.get_body(BodyIndex(number)) for number in range(1, plant.num_bodies())]
    links = {}
    for body in bodies:
        pose = whole @ body.EvalPoseInWorld(context)
        inertia = body.default_spatial_inertia()
        center = inertia.get_com()
        turn = pose.rotation().matrix()
        about = inertia.Shift(center).CalcRotationalInertia().CopyToFullMatrix3()
        links[name(body)] = {
            "mass": inertia.get_mass(), "pose": pose.GetAsMatrix4().tolist(), "center": (pose @ center).tolist(),
            "tensor": (turn @ about @ turn.T).tolist(),
            "group": min(name(other) for other in plant.GetBodiesWeldedTo(body)),
        }  # fmt: skip
    joints = []
    for number in range(plant.num_joints()):
        joint = plant.get_joint(JointIndex(number))
        if joint.type_name() in {"revolute", "prismatic"}:
            axis = joint.revolute_axis() if joint.type_name() == "revolute" else joint.translation_axis()
            frame = whole @ joint.frame_on_parent().CalcPoseInWorld(context)
            joints.append([*frame.translation(), *(frame.rotation() @ np.array(axis))])
    return {"links": links, "joints": joints, "model": model.CalcPoseInWorld(context).GetAsMatrix4().tolist()}


def name(body: object) -> str:
    """The whole name of a link, without that of the outermost model."""
    return body.scoped_name().get_full().partition("::")[2]


if __name__ == "__main__":
    logging.getLogger("drake").setLevel(logging.ERROR)
    found = {}
    for path in sys.argv[1:]:
        try:
            found[path] = places(Path(path))
        except RuntimeError as error:
            found[path] = {"refused": str(error)}
    print(json.dumps(found))
