"""Drake's Parser, with libsdformat inside, as the oracle of models of Gazebo: as boats, as objects and in worlds."""

import json
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.random_models import write_models
from needs import DRAKE, DRAKE_PYTHON, needs
from vrx_mj.formats.gazebo.sdf_boats import read_boat
from vrx_mj.frames import rotation

pytestmark = [
    pytest.mark.slow,
    needs(DRAKE),
    pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning"),
]
FEW, MANY = 25, 500
EQUAL = 1e-8
"""Of places [m], unit vectors, and shares of masses and of the largest moment: products of a dozen rotations."""


def places_of(files):
    """What Drake makes of files: by each file, links, joints that move, and the place of the model."""
    script = Path(__file__).with_name("drake_places.py")
    done = subprocess.run(
        [str(DRAKE_PYTHON), str(script), *map(str, files)], capture_output=True, text=True, check=True
    )
    return {file: json.loads(done.stdout)[str(file)] for file in files}


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation(*pose[3:]), pose[:3]
    return result


def full(tensor):
    xx, yy, zz, xy, xz, yz = tensor
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def row(mass, center, tensor):
    """Logarithm of the mass, its centre, logarithm of the largest moment, and moments as shares of that."""
    largest = np.abs(tensor).max()
    return np.concatenate(([np.log(mass)], center, [np.log(largest)], np.ravel(tensor) / largest))


def unmatched(ours, theirs):
    """Rows of masses or joints that the others have not."""
    left = [np.array(one) for one in theirs]
    odd = []
    for one in ours:
        near = next((k for k, other in enumerate(left) if np.abs(one - other).max() < EQUAL), None)
        if near is None:
            odd.append(one)
        else:
            del left[near]
    return [*odd, *left]


def moved(drake, turn, shift):
    """Links and joints of Drake, turned and shifted: name of the link -> mass, centre, tensor; and joints."""
    links = {
        name: (link["mass"], turn @ link["center"] + shift, turn @ np.array(link["tensor"]) @ turn.T)
        for name, link in drake["links"].items()
    }
    joints = []
    for values in drake["joints"]:
        axis = turn @ values[3:]
        joints.append(np.concatenate((turn @ values[:3] + shift, axis / np.linalg.norm(axis))))
    return links, joints


def grouped(drake, links):
    """Rows of masses of what fixed joints hold together."""
    groups = {}
    for name, link in drake["links"].items():
        groups.setdefault(link["group"], []).append(links[name])
    for members in groups.values():
        mass = sum(one for one, _, _ in members)
        center = sum(one * place for one, place, _ in members) / mass
        arms = [(one, place - center, tensor) for one, place, tensor in members]
        spread = sum(tensor + one * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for one, arm, tensor in arms)
        yield row(mass, center, spread)


def compare_boat(file, drake):
    """Each link of a model as a boat, whose frame has the model's axes and the root link's place."""
    robot = read_boat(file)
    links, joints = moved(drake, np.eye(3), -np.array(drake["links"][robot.root]["pose"])[:3, 3])
    assert robot.links.keys() == links.keys()
    for name, link in robot.links.items():
        own = matrix(robot.places[name]) @ matrix(link.inertial.pose)
        turn = own[:3, :3]
        mine = row(link.inertial.mass, own[:3, 3], turn @ full(link.inertial.tensor) @ turn.T)
        assert unmatched([mine], [row(*links[name])]) == [], name
    mine = []
    for joint in robot.joints.values():
        if joint.type != "fixed":
            own = matrix(robot.places[joint.child])
            mine.append(np.concatenate((own[:3, 3], own[:3, :3] @ joint.axis)))
    assert unmatched(mine, joints) == []


def compare_compiled(world, drake, turn, shift):
    """Bodies and joints of the one object in a compiled world, with all joints at zero."""
    compiled = vrx_mj.compile_world(world, fleet={"boats": []})
    model = mujoco.MjModel.from_xml_string(compiled.mjcf, dict(compiled.assets))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    links, joints = moved(drake, turn, shift)
    root = next(body for body in range(1, model.nbody) if model.body(body).name.startswith("top"))
    mine = []
    for body in np.flatnonzero(model.body_rootid == model.body_rootid[root]):
        axes = data.ximat[body].reshape(3, 3)
        mine.append(row(model.body_mass[body], data.xipos[body], axes @ np.diag(model.body_inertia[body]) @ axes.T))
    assert unmatched(mine, [*grouped(drake, links)]) == []
    free = [k for k in range(model.njnt) if model.jnt_type[k] >= 2 and model.body_rootid[model.jnt_bodyid[k]] == root]
    assert unmatched([np.concatenate((data.xanchor[k], data.xaxis[k])) for k in free], joints) == []


@pytest.fixture
def models(tmp_path, monkeypatch):
    def made(count):
        files = [write_models(seed, tmp_path / str(seed)) for seed in range(count)]
        found = places_of(files)
        assert [drake["refused"] for drake in found.values() if "refused" in drake] == []
        for file, drake in found.items():
            monkeypatch.chdir(file.parent.parent)
            yield file, drake

    return made


def compared(models, count):
    for file, drake in models(count):
        compare_boat(file, drake)
        compare_compiled({"sea": {"model": "none"}, "objects": [{"name": "top", "model": str(file)}]}, drake,
                         np.eye(3), np.zeros(3))  # fmt: skip
        text = file.read_text(encoding="utf-8")
        world = file.with_name("inline.world")
        world.write_text(text.replace("<model", '<world name="w"><model', 1).replace("</sdf>", "</world></sdf>"),
                         encoding="utf-8")  # fmt: skip
        place = np.array(drake["model"])
        compare_compiled(str(world), drake, place[:3, :3], place[:3, 3])


def test_models_are_as_drake_reads_them(models):
    compared(models, FEW)


@pytest.mark.nightly
def test_many_models_are_as_drake_reads_them(models):
    compared(models, MANY)
