"""Small boats as URDF text, for tests: a hull, and what hangs on it."""

from pathlib import Path

from vrx_mj.config.robots import RobotConfig
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.mjcf.boats import assemble_boat

FILE = Path("boat.urdf")
INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
BOX = '<collision><geometry><box size="4 1 0.5"/></geometry></collision>'


def link(name, mass=1, shapes=""):
    inertial = f'<inertial><mass value="{mass}"/>{INERTIA}</inertial>' if mass else ""
    return f'<link name="{name}">{inertial}{shapes}</link>'


def joint(name, child, parent="base_link", kind="revolute", xyz="0 0 0", rpy="0 0 0", axis="0 0 1", limits=(-3, 3)):
    limit = f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="7" velocity="0.5"/>' if limits else ""
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def thruster(name, engine=None, propeller=None):
    """VRX's plugin with one thruster."""
    engine = f"<engineJointName>{engine}</engineJointName>" if engine else ""
    return (
        f'<gazebo><plugin name="{name}" filename="libusv_gazebo_thrust_plugin.so"><thruster>'
        f"<linkName>{propeller or name + '_propeller'}</linkName>{engine}<cmdTopic>{name}_thrust_cmd</cmdTopic>"
        f"<enableAngle>{str(bool(engine)).lower()}</enableAngle></thruster></plugin></gazebo>"
    )


def robot(*parts, hull=None):
    """One element a line: the hull is line 2."""
    hull = link("base_link", mass=100, shapes=BOX) if hull is None else hull
    return "\n".join(['<robot name="boat">', hull, *parts, "</robot>"])


def assemble(*parts, hull=None, **config):
    """The boat of a URDF's parts and of the YAML beside it."""
    urdf = read_urdf(robot(*parts, hull=hull), FILE)
    return assemble_boat(urdf, RobotConfig.model_validate({"urdf": FILE.name, **config}))
