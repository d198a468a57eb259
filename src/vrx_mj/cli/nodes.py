"""Nodes that the launch files of `vrx-mj ros packages` start: each is a command of ours, by roslaunch's arguments.

`python -m vrx_mj.cli.nodes NODE ARGUMENTS...`
"""

import os
import shlex
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from vrx_mj.cli.screen import show, show_error
from vrx_mj.errors import CommandError, NetworkError, VrxError
from vrx_mj.outputs import write_file

if TYPE_CHECKING:
    from vrx_mj.ros.messages import Message
    from vrx_mj.ros.ros1.tcpros import Client

_FOLDER = "VRX_MJ_FOLDER"
"""Environment variable with the folder in which roslaunch was started: nodes run in that of its logs."""
Words = list[str]
"""Words of a command line of `vrx-mj`."""
_GZSERVER = {"-s", "--server-plugin", "--record_path", "--record_period", "--seed", "-e", "--physics", "--iters"}
"""Options of gzserver with a value, which `vrx-mj serve` has no use for."""
_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that stop a program."""
_SOURCES = ("file", "param", "stdin", "database")
_PATIENCE = 300.0
"""Wall time that a world may take until it is served [s]: the first on a machine compiles its kernels."""
_MOST_CHARACTERS = 20_000_000
"""Characters of a description, at most."""


def main() -> None:
    """Run a node; the exit code is that of the first command that fails."""
    node, *given = sys.argv[1:]
    words, folder = [word for word in given if not word.startswith("__")], Path(os.environ.get(_FOLDER) or ".")
    with suppress(OSError):  # it may have gone since
        os.chdir(folder)
    try:
        lines = NODES[node](words, folder)
    except VrxError as error:
        show_error(str(error))
        raise SystemExit(2) from None
    for line in lines:
        from vrx_mj.cli.program import main as run_command

        sys.argv[1:] = line
        try:
            run_command()
        except SystemExit as end:
            verdict = end.code == 1 and line[:2] == ["robot", "check"]  # VRX's generator ends cleanly all the same
            if end.code and not verdict:
                raise


def _serve(words: Sequence[str], folder: Path) -> list[Words]:
    """Words that serve one of VRX's own launch files."""
    name, given = words[0], _named_arguments(words[1:])
    options = _options(given)
    for key in ("world", "urdf"):
        if key in given:
            given[key] = _absolute(given[key], folder)
    return [["serve", name, *(f"{key}:={value}" for key, value in given.items()), *options]]


def _gzserver(words: Sequence[str], folder: Path) -> list[Words]:
    """A world without boats."""
    from vrx_mj.formats.gazebo.launched import named_world

    given = _named_arguments(words)
    if Path(given["world_name"]).stem == "empty":
        example = "world_name:=$(find vrx_gazebo)/worlds/sandisland.world"
        raise CommandError(f"no world: give empty_world.launch the path of one, as {example}")
    return [["serve", str(named_world(_absolute(given["world_name"], folder))), "--fleet", "none", *_options(given)]]


def _generate_wamv(words: Sequence[str], folder: Path) -> list[Words]:
    """A URDF, and what the rules say."""
    given = _named_arguments(words) or _parameters("thruster_yaml", "component_yaml", "wamv_target", "wamv_locked")
    paths = {key: _absolute(value, folder) for key, value in given.items() if key != "wamv_locked"}
    components = paths.get("sensor_yaml") or paths["component_yaml"]
    files = ["--thrusters", paths["thruster_yaml"], "--components", components]
    locked = ["--locked"] if _is_true(given.get("wamv_locked", "")) else []
    return [["robot", "build", *files, *locked, "-o", paths["wamv_target"]], ["robot", "check", *files]]


def _generate_worlds(words: Sequence[str], folder: Path) -> list[Words]:
    """The worlds of an axes file."""
    given = _named_arguments(words) or _parameters("requested", "world_target")
    file, target = (_absolute(given[name], folder) for name in ("requested", "world_target"))
    return [["worlds", "generate", file, "-o", target]]


def _parameters(*names: str) -> dict[str, str]:
    """Parameters by their names, in which copies of VRX's launch files have what ours give as arguments."""
    from vrx_mj.ros.ros1.tcpros import Client

    client = Client("generator")
    return {name: str(client.parameter(name)) for name in names}


def _teleop(words: Sequence[str], _: Path) -> list[Words]:
    """Keys or, at a port, a page with a joystick, for the boat of the arguments or of the node's namespace."""
    given = _named_arguments(words)
    boat = given.get("namespace") or os.environ.get("ROS_NAMESPACE", "").strip("/")
    options = {"--boat": boat, "--url": given.get("url"), "--web": given.get("port")}
    return [["teleop", *(word for name, value in options.items() if value for word in (name, value))]]


def _missing(words: Sequence[str], _: Path) -> list[Words]:
    """A launch file of VRX that is not there; a line says what to do instead."""
    show_error(f"{words[0]} is not supported: {' '.join(words[1:])}")
    raise SystemExit(1)


def _idle(_: Sequence[str], __: Path) -> list[Words]:
    """A node of VRX for what `vrx-mj serve` does itself."""
    show("nothing to do: vrx-mj serve shows the beacon, and vrx-mj teleop sets thrust and angles")
    await_end()
    return []


def _xacro(words: Sequence[str], folder: Path) -> list[Words]:
    """The URDF or SDF of a xacro file, by arguments NAME:=VALUE, on the standard output or in the file of `-o`."""
    from vrx_mj.config.search import package_paths
    from vrx_mj.formats.gazebo.document import LIBRARIES
    from vrx_mj.formats.gazebo.worlds import is_gazebo_world
    from vrx_mj.formats.urdf.expand import expand

    words = list(words)
    output = words.pop(words.index("-o") + 1) if "-o" in words[:-1] else None
    files = [word for word in words if not word.startswith("-") and ":=" not in word]
    if len(files) != 1:
        raise CommandError(f"xacro needs one file, got {len(files)}: xacro FILE NAME:=VALUE")
    file = Path(_absolute(files[0], folder))
    libraries = LIBRARIES if is_gazebo_world(file) else ()
    text = expand(file, arguments=_named_arguments(words), package_paths=package_paths(), libraries=libraries)
    if output is None:
        sys.stdout.write(text)
    else:
        write_file(Path(_absolute(output, folder)), text, "the expanded file")
    return []


def _options(given: dict[str, str]) -> Words:
    """Options of `vrx-mj serve`, taken out of the arguments of a launch file."""
    options = ["--paused"] if _is_true(given.pop("paused", "")) else []
    extra = given.pop("extra_gazebo_args", "")
    try:
        return [*options, *_own(shlex.split(extra))]
    except ValueError as error:
        raise CommandError(f"invalid extra_gazebo_args '{extra}': {error}") from None


def _own(words: Sequence[str]) -> Words:
    """The options of `vrx-mj serve` among words for the command line of gzserver; a line names what is left out."""
    from typer.core import TyperOption

    from vrx_mj.cli.program import load_command

    options = [one for one in load_command("serve").params if isinstance(one, TyperOption)]
    taken = {name: 1 + (not one.is_flag) for one in options for name in one.opts}
    found: Words = []
    lost: Words = []
    index = 0
    while index < len(words):
        count = taken.get(words[index].partition("=")[0], 0)
        if count:
            is_alone = "=" in words[index] or "".join(words[index + 1 : index + 2]).startswith("--")
            count = 1 if is_alone else count
            found += words[index : index + count]
        else:
            count = 1 + (words[index] in _GZSERVER)
            lost += words[index : index + count]
        index += count
    if lost:
        show(f"extra_gazebo_args: {' '.join(lost)} ignored; only options of vrx-mj serve are used", "yellow")
    return found


def _named_arguments(words: Sequence[str]) -> dict[str, str]:
    """Arguments NAME:=VALUE by name; those without a value are not given."""
    pairs = (word.partition(":=") for word in words if ":=" in word)
    return {name: value for name, _, value in pairs if value}


def _absolute(path: str, folder: Path) -> str:
    """A path that begins in the folder of a shell."""
    from vrx_mj.formats.gazebo.document import home_path

    return str(folder / home_path(path))


def _is_true(text: str) -> bool:
    return text.lower() in {"true", "1"}


def spawn_model(words: Sequence[str], folder: Path) -> list[Words]:
    """Spawn a model by the options of gazebo_ros; no command is left to run.

    Raises:
        CommandError: an option is wrong, or the world refuses the model.
        NetworkError: no world is served.
    """
    given = _spawn_options(words)
    from vrx_mj.ros.messages import new
    from vrx_mj.ros.ros1.tcpros import Client

    client = Client("spawn_model")
    text = _description(given, client, folder)
    model = _name(given, text)
    gazebo = given.get("gazebo_namespace", "/gazebo").rstrip("/")
    kind = "sdf" if "sdf" in given else "urdf"
    client.wait(f"{gazebo}/spawn_{kind}_model", _PATIENCE)
    if "wait" in given:
        _wait_for(client, gazebo, given["wait"])
    answer = client.call(f"{gazebo}/spawn_{kind}_model", "gazebo_msgs/SpawnModel", _spawn_request(given, model, text))
    if not answer.success:
        raise CommandError(f"{model} cannot join: {answer.status_message}")
    show(answer.status_message)
    if "unpause" in given:
        client.call(f"{gazebo}/unpause_physics", "std_srvs/Empty", new("std_srvs/EmptyRequest"))
    if "b" in given:
        await_end()
        request = new("gazebo_msgs/DeleteModelRequest", model_name=model)
        show(client.call(f"{gazebo}/delete_model", "gazebo_msgs/DeleteModel", request).status_message)
    return []


def _spawn_options(words: Sequence[str]) -> dict[str, str]:
    """Options by name; those without a value are empty."""
    from vrx_mj.formats.gazebo.launched import spawn_options

    found = spawn_options(words)
    if "J" in found:
        show(f"-J {found['J']} is ignored: joints start at 0", "yellow")
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
            raise CommandError("-database names an SDF model: also give -sdf")
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


def _spawn_request(given: Mapping[str, str], model: str, text: str) -> "Message":
    """The request of the service."""
    from vrx_mj.formats.gazebo.launched import POSE, pose_of_words
    from vrx_mj.frames import quaternion
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
    signal.pthread_sigmask(signal.SIG_BLOCK, _STOP_SIGNALS)
    signal.sigwait(_STOP_SIGNALS)


def _wait_for(client: "Client", gazebo: str, model: str) -> None:
    """Wait for another model."""
    from vrx_mj.ros.messages import new

    request = new("gazebo_msgs/GetModelStateRequest", model_name=model)
    end = time.monotonic() + _PATIENCE
    while not client.call(f"{gazebo}/get_model_state", "gazebo_msgs/GetModelState", request).success:
        if time.monotonic() > end:
            raise NetworkError(f"the model '{model}' of -wait did not appear within {_PATIENCE:g} s")
        time.sleep(0.2)


NODES: Mapping[str, Callable[[Sequence[str], Path], list[Words]]] = {
    "vrx_mj_serve": _serve,
    "gzserver": _gzserver,
    "generate_wamv.py": _generate_wamv,
    "generate_worlds.py": _generate_worlds,
    "keydrive": _teleop,
    "teleop_twist_keyboard.py": _teleop,
    "joydrive": _teleop,
    "playback": lambda words, folder: [["replay", _absolute(_named_arguments(words)["log_file"], folder)]],
    "missing": _missing,
    "spawn_wamv.bash": spawn_model,
    "pinger_visualization.py": _idle,
    "key2thrust_angle.py": _idle,
    "spawn_model": spawn_model,
    "xacro": _xacro,
    "xacro.py": _xacro,
}
"""Functions of nodes by their type: each acts on its arguments, and returns the command lines of `vrx-mj` to run."""

if __name__ == "__main__":
    main()
