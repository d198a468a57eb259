"""The node `spawn_model` of gazebo_ros: a model of a parameter or a file joins the world that is served."""

import signal
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from vrx_mj.cli.screen import show
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.frames import quaternion

if TYPE_CHECKING:
    from vrx_mj.ros.messages import Message
    from vrx_mj.ros.ros1.client import Client

_ENDS = (signal.SIGINT, signal.SIGTERM)

_SOURCES = ("file", "param", "stdin", "database")
_PATIENCE = 300.0
"""Wall time that a world may take until it is served [s]: the first on a machine compiles its kernels."""
_MOST_CHARACTERS = 20_000_000
"""Characters of a description, at most."""


def spawn_model(words: Sequence[str], folder: Path) -> int:
    """Spawn a model by the options of gazebo_ros, and return the exit code.

    Raises:
        CommandError: an option is wrong, or the world refuses the model.
        NetworkError: no world is served.
    """
    given = _options(words)
    from vrx_mj.ros.messages import new
    from vrx_mj.ros.ros1.client import Client

    client = Client("spawn_model")
    text = _description(given, client, folder)
    model = _name(given, text)
    gazebo = given.get("gazebo_namespace", "/gazebo").rstrip("/")
    kind = "sdf" if "sdf" in given else "urdf"
    client.wait(f"{gazebo}/spawn_{kind}_model", _PATIENCE)
    if "wait" in given:
        _wait_for(client, gazebo, given["wait"])
    answer = client.call(f"{gazebo}/spawn_{kind}_model", "gazebo_msgs/SpawnModel", _request(given, model, text))
    if not answer.success:
        raise CommandError(f"{model} cannot join: {answer.status_message}")
    show(answer.status_message)
    if "unpause" in given:
        client.call(f"{gazebo}/unpause_physics", "std_srvs/Empty", new("std_srvs/EmptyRequest"))
    if "b" in given:
        await_end()
        request = new("gazebo_msgs/DeleteModelRequest", model_name=model)
        show(client.call(f"{gazebo}/delete_model", "gazebo_msgs/DeleteModel", request).status_message)
    return 0


def _options(words: Sequence[str]) -> dict[str, str]:
    """Options by name; those without a value are empty."""
    from vrx_mj.formats.gazebo.launched import spawn_options

    found = spawn_options(words)
    if "J" in found:
        show(f"-J {found['J']} is ignored: joints begin at 0", "yellow")
    if "model" not in found:
        raise CommandError("spawn_model needs -model NAME")
    sources = [name for name in _SOURCES if name in found]
    if len(sources) != 1:
        raise CommandError(
            f"spawn_model needs one of -file, -param, -stdin and -database, got {', '.join(sources) or 'none'}"
        )
    return found


def _description(given: Mapping[str, str], client: "Client", folder: Path) -> str:
    """The text of a model."""
    if "database" in given:
        if "sdf" not in given:
            raise CommandError("-database names a model of SDF: give -sdf too")
        return f"<sdf><world><include><uri>model://{escape(given['database'])}</uri></include></world></sdf>"
    if "param" in given:
        text = str(client.parameter(given["param"]))
    elif "file" in given:
        file = folder / given["file"]
        if file.suffix == ".xacro":
            from vrx_mj.config.search import package_paths
            from vrx_mj.formats.urdf.expand import expand

            return expand(file, package_paths=package_paths())
        try:
            text = file.read_bytes()[:_MOST_CHARACTERS].decode("utf-8", "replace")
        except OSError as error:
            raise CommandError(f"{file}: cannot be read: {error.strerror}") from None
    else:
        text = sys.stdin.read(_MOST_CHARACTERS)
    if not text.strip():
        raise CommandError(f"the description of {given['model']} is empty")
    return text


def _name(given: Mapping[str, str], text: str) -> str:
    """The name of the model here: its namespace, which is that of its links and topics."""
    from vrx_mj.formats.urdf.reader import namespace_of

    own = given.get("robot_namespace", "").strip("/") or ("" if "sdf" in given else namespace_of(text))
    if own and own != given["model"]:
        show(f"-model {given['model']}: the model is called {own} here, as its topics are", "yellow")
    return own or given["model"]


def _request(given: Mapping[str, str], model: str, text: str) -> "Message":
    """The request of the service."""
    from vrx_mj.formats.gazebo.launched import POSE, pose_of_words
    from vrx_mj.ros.messages import new

    try:
        x, y, z, roll, pitch, yaw = pose_of_words(given.get(key, "0") for key in POSE)
    except ValueError as error:
        raise CommandError(f"-x -y -z -R -P -Y: {error}") from None
    qw, qx, qy, qz = quaternion(roll, pitch, yaw)
    pose = new(
        "geometry_msgs/Pose",
        position=new("geometry_msgs/Point", x=x, y=y, z=z),
        orientation=new("geometry_msgs/Quaternion", x=qx, y=qy, z=qz, w=qw),
    )
    return new(
        "gazebo_msgs/SpawnModelRequest",
        model_name=model,
        model_xml=text,
        robot_namespace=given.get("robot_namespace", ""),
        initial_pose=pose,
        reference_frame=given.get("reference_frame", ""),
    )


def await_end() -> None:
    """Wait for Ctrl-C or SIGTERM."""
    signal.pthread_sigmask(signal.SIG_BLOCK, _ENDS)
    signal.sigwait(_ENDS)


def _wait_for(client: "Client", gazebo: str, model: str) -> None:
    """Wait for another model."""
    from vrx_mj.ros.messages import new

    request = new("gazebo_msgs/GetModelStateRequest", model_name=model)
    end = time.monotonic() + _PATIENCE
    while not client.call(f"{gazebo}/get_model_state", "gazebo_msgs/GetModelState", request).success:
        if time.monotonic() > end:
            raise NetworkError(f"the model '{model}' of -wait did not come within {_PATIENCE:g} s")
        time.sleep(0.2)
