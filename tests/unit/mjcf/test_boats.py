"""Boats from URDFs: what steers, where the thrust acts, what is rigid, and what cannot be."""

import math

import pytest

from urdf_boats import assemble, joint, link, thruster
from vrx_mj.config.dynamics import ServoConfig
from vrx_mj.errors import ConfigError
from vrx_mj.frames import apply, compose, rotation
from vrx_mj.mjcf.boats import push_center

ENGINE_AT, PROPELLER_AT = (-2.0, 0.5, 0.3, 0.1, -0.2, 0.4), (-0.3, 0.1, -0.5, 0.0, 0.0, 0.2)
AXES = [(0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 0, 0), (0.6, 0, 0.8), (1, -2, 3)]


def words(numbers):
    return " ".join(str(number) for number in numbers)


def outboard(name="left", axis=(0, 0, 1), prefix="", **joint_of_engine):
    """An engine on a hinge with a propeller on a shaft, and VRX's plugin for them."""
    engine, propeller, hinge = (f"{prefix}{name}{end}" for end in ("_engine", "_propeller", "_hinge"))
    return (
        link(engine, 15),
        link(propeller, 0.5),
        joint(hinge, engine, f"{prefix}base_link", xyz=words(ENGINE_AT[:3]), rpy=words(ENGINE_AT[3:]),
              axis=words(axis), **joint_of_engine),
        joint(f"{prefix}{name}_shaft", propeller, engine, "continuous", words(PROPELLER_AT[:3]),
              words(PROPELLER_AT[3:]), axis="1 0 0"),
        thruster(name, hinge, propeller),
    )  # fmt: skip


def the(pairs):
    (item,) = pairs
    return item


def refused(*parts, **config):
    with pytest.raises(ConfigError) as caught:
        assemble(*parts, **config)
    return str(caught.value)


# Hinges


@pytest.mark.parametrize("axis", AXES)
def test_a_hinge_of_any_axis_is_a_frame_whose_z_axis_is_that_axis(axis):
    engine = the(assemble(*outboard(axis=axis)).thrusters)
    assert engine.pose[:3] == pytest.approx(ENGINE_AT[:3])
    unit = [value / math.hypot(*axis) for value in axis]
    expected = apply(rotation(*ENGINE_AT[3:]), unit)
    assert apply(rotation(*engine.pose[3:]), (0, 0, 1)) == pytest.approx(expected)


@pytest.mark.parametrize("axis", AXES)
def test_at_zero_steering_thrust_acts_at_the_propellers_origin_along_its_x_whatever_the_axis(axis):
    engine = the(assemble(*outboard(axis=axis)).thrusters)
    propeller = compose(ENGINE_AT, PROPELLER_AT)
    assert compose(engine.pose, (*engine.center, 0, 0, 0))[:3] == pytest.approx(propeller[:3])
    forward = apply(rotation(*propeller[3:]), (1, 0, 0))
    assert apply(rotation(*engine.pose[3:]), engine.direction) == pytest.approx(forward)


@pytest.mark.parametrize("axis", AXES)
def test_what_turns_is_where_the_urdf_puts_it_at_zero(axis):
    engine = the(assemble(*outboard(axis=axis)).thrusters)
    found = {part.name: compose(engine.pose, part.pose) for part in engine.parts}
    expected = {"left_engine": ENGINE_AT, "left_propeller": compose(ENGINE_AT, PROPELLER_AT)}
    assert found.keys() == expected.keys()
    for name, pose in expected.items():
        assert found[name][:3] == pytest.approx(pose[:3])
        for mine, theirs in zip(rotation(*found[name][3:]), rotation(*pose[3:]), strict=True):
            assert mine == pytest.approx(theirs)


def test_what_turns_is_not_part_of_the_hull_and_not_lumped():
    boat = assemble(*outboard(), link("box"), joint("lid", "box", kind="fixed"))
    assert [(part.name, part.lumped) for part in boat.parts] == [("base_link", True), ("box", True)]
    assert [part.lumped for part in boat.thrusters[0].parts] == [True, False]  # each in its hinge's frame


def test_a_locked_hinge_is_a_link_of_its_own_and_steers_nothing():
    boat = assemble(*outboard(limits=(0, 0)))
    engine = the(boat.thrusters)
    assert (engine.joint, engine.parts, engine.drive.max_angle) == (None, (), 0)
    assert [(part.name, part.lumped) for part in boat.parts][1:] == [("left_engine", True), ("left_propeller", False)]
    assert boat.warnings == ()


@pytest.mark.parametrize("vrx", [True, False])
def test_a_joint_that_is_held_holds_like_a_fixed_one_unless_vrxs_plugin_has_the_water(vrx):
    """Gazebo makes no one link of what such a joint holds, and VRX's plugin pushes at the centre of that link."""
    water = '<gazebo><plugin name="water" filename="libusv_gazebo_dynamics_plugin.so"/></gazebo>'
    boat = assemble(link("keel", 50), joint("bolt", "keel", limits=(0, 0), xyz="0 0 -0.6"), *([water] if vrx else []))
    assert [part.lumped for part in boat.parts] == [True, not vrx]
    assert push_center(boat) == pytest.approx([0, 0, 0 if vrx else -0.2])


def test_a_propeller_without_an_engine_pushes_from_its_own_frame():
    parts = (link("left_propeller"), joint("shaft", "left_propeller", xyz="-2 0.5 0", rpy="0 0 0.3", kind="continuous"))
    engine = the(assemble(*parts, thruster("left")).thrusters)
    assert (engine.link, engine.joint, engine.parts) == ("left_propeller", None, ())
    assert engine.pose == pytest.approx((-2, 0.5, 0, 0, 0, 0.3))
    assert (engine.center, engine.direction, engine.drive.max_angle) == ((0, 0, 0), (1, 0, 0), 0)


def test_a_long_chain_of_links_is_followed():
    count = 1500
    chain = [
        part
        for i in range(count)
        for part in (link(f"l{i}", 0), joint(f"j{i}", f"l{i}", f"l{i - 1}" if i else "base_link", "fixed", "0.01 0 0"))
    ]
    boat = assemble(*chain, link("left_propeller"), joint("shaft", "left_propeller", f"l{count - 1}", "fixed"),
                    thruster("left"))  # fmt: skip
    assert the(boat.thrusters).pose[:3] == pytest.approx((0.01 * count, 0, 0))


# Limits of steering


@pytest.mark.parametrize(
    ("limits", "angle", "warning"),
    [
        ((-3, 3), math.pi / 2, ()),  # the plugin's
        ((-0.5, 0.5), 0.5, ()),
        (
            (-0.2, 0.6),
            0.2,
            ("joint 'left_hinge' has limits -0.2 and 0.6 rad: 'left' turns 0.2 rad either way at most",),
        ),
    ],
)
def test_an_engine_turns_as_far_as_its_joint_and_its_plugin_let_it(limits, angle, warning):
    boat = assemble(*outboard(limits=limits))
    assert the(boat.thrusters).drive.max_angle == pytest.approx(angle)
    assert boat.warnings == warning


def test_a_hinge_that_cannot_leave_zero_one_way_does_not_steer():
    boat = assemble(*outboard(limits=(0, 0.6)))
    assert (the(boat.thrusters).joint, the(boat.thrusters).drive.max_angle) == (None, 0)
    assert boat.warnings == ("joint 'left_hinge' has limits 0 and 0.6 rad: 'left' does not steer",)


def test_the_servo_is_as_strong_as_the_joint_unless_the_yaml_says_so():
    assert the(assemble(*outboard()).thrusters).servo == ServoConfig(kp=300, kd=20, effort=7, velocity=0.5)
    mine = {"kp": 1, "kd": 2, "effort": 3, "velocity": 4}
    entry = {"propeller": "left_propeller", "joint": "left_hinge", "mapping": "linear"}
    boat = assemble(*outboard(), thrusters={"left": {**entry, "servo": mine}})
    assert the(boat.thrusters).servo == ServoConfig(**mine)
    boat = assemble(*outboard(), thrusters={"left": entry})
    assert the(boat.thrusters).servo == ServoConfig(kp=300, kd=20, effort=7, velocity=0.5)


# Sensors


def test_two_sensors_on_a_link_are_called_by_their_own_names_without_the_namespace():
    sensors = "".join(f'<sensor name="wamv/ins_{kind}" type="{kind}"><update_rate>5</update_rate></sensor>'
                      for kind in ("imu", "gps"))  # fmt: skip
    parts = (link("wamv/ins"), joint("ins_joint", "wamv/ins", "wamv/base_link", "fixed"),
             f'<gazebo reference="wamv/ins">{sensors}</gazebo>')  # fmt: skip
    boat = assemble(*parts, hull=link("wamv/base_link", 100))
    assert [(sensor.name, sensor.link) for sensor in boat.sensors] == [("ins", "ins"), ("ins_gps", "ins")]


# The YAML beside it


@pytest.mark.parametrize("given", ["", "wamv/"])
def test_the_yaml_names_links_and_joints_with_or_without_the_namespace(given):
    entry = {"propeller": f"{given}left_propeller", "joint": f"{given}left_hinge", "mapping": "linear"}
    sensor = {"type": "imu", "name": "imu", "link": f"{given}left_engine", "pose": [0, 0, 1, 0, 0, 0]}
    parts = outboard(prefix="wamv/")[:-1]
    boat = assemble(*parts, hull=link("wamv/base_link", 100), thrusters={"port": entry}, sensors=[sensor])
    engine, imu = the(boat.thrusters), the(boat.sensors)
    assert (boat.link, engine.name, engine.link, engine.joint) == ("base_link", "port", "left_engine", "left_hinge")
    assert (imu.link, imu.frame) == ("left_engine", "left_engine")
    assert imu.pose == pytest.approx(compose(ENGINE_AT, (0, 0, 1, 0, 0, 0)))
    assert boat.warnings == ("sensor 'imu' does not turn with the thruster 'port' on which it is mounted",)


def test_thrusters_of_the_yaml_take_the_place_of_the_plugins():
    entry = {"propeller": "left_propeller", "mapping": "linear", "max_force_forward": 40}
    boat = assemble(*outboard(), thrusters={"port": entry})
    assert (the(boat.thrusters).name, the(boat.thrusters).drive.max_force_forward) == ("port", 40)
    assert boat.warnings == ()  # the engine is held at zero, as VRX holds one that is not to steer


RUDDER = {"joint": "stock", "area": 0.1, "aspect_ratio": 1.5}


def rudder(axis="0 0 1", **joint_of_rudder):
    return link("blade"), joint("stock", "blade", xyz="-2 0 0.1", axis=axis, **joint_of_rudder)


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1", "0.3 0 0.9"])
def test_a_rudder_pushes_at_its_centre_of_pressure(axis):
    entry = {**RUDDER, "center": [-0.1, 0, -0.2]}
    blade = the(assemble(*rudder(axis), rudders={"rudder": entry}).thrusters)
    assert compose(blade.pose, (*blade.center, 0, 0, 0))[:3] == pytest.approx((-2.1, 0, -0.1))
    assert (blade.name, blade.link, blade.joint, blade.direction) == ("rudder", "blade", "stock", (0, 1, 0))
    assert (blade.blade.area, blade.blade.aspect_ratio, blade.blade.propeller) == (0.1, 1.5, None)


@pytest.mark.parametrize(("limits", "angle"), [((-3, 3), 0.6109), ((-0.3, 0.3), 0.3)])
def test_a_rudder_turns_as_far_as_its_joint_and_its_entry_let_it(limits, angle):
    blade = the(assemble(*rudder(limits=limits), rudders={"rudder": RUDDER}).thrusters)
    assert blade.drive.max_angle == pytest.approx(angle)


# What is odd


def test_joints_that_move_nothing_are_said():
    boat = assemble(*outboard(), link("dish"), joint("turntable", "dish", kind="continuous"),
                    link("gate"), joint("slide", "gate", kind="prismatic"))  # fmt: skip
    assert boat.warnings == (
        "joint 'turntable' (continuous) is not simulated: it stays at zero",
        "joint 'slide' (prismatic) is not simulated: it stays at zero",
    )


def test_a_boat_without_thrusters_is_said():
    text = "no thruster, so the boat drifts; add `thrusters` to the YAML beside it"
    assert assemble().warnings == (text,)
    assert assemble(thrusters={}).warnings == ()  # its file says so


# What cannot be


def test_one_joint_steers_one_thing():
    both = (*outboard(), link("second"), joint("shaft", "second", "left_engine", "fixed"),
            thruster("second", "left_hinge", "second"))  # fmt: skip
    assert refused(*both) == (
        "boat.urdf:5: joint 'left_hinge': steers both 'left' and 'second'; each needs a joint of its own"
    )


def test_what_steers_does_not_hang_on_what_steers():
    parts = (*outboard(), link("blade"), joint("stock", "blade", "left_engine"))
    assert refused(*parts, rudders={"rudder": RUDDER}) == (
        "boat.urdf:9: joint 'stock': steers 'rudder' and moves with 'left_hinge', which steers 'left': "
        "no steering joint may move with another one"
    )


def test_a_propeller_hangs_on_the_joint_that_steers_it():
    parts = (*rudder(), link("left_propeller"), joint("shaft", "left_propeller", kind="fixed"),
             thruster("left", "stock"))  # fmt: skip
    assert refused(*parts) == (
        "boat.urdf:4: joint 'stock': steers 'left', whose propeller 'left_propeller' does not move with it"
    )


def test_a_propeller_does_not_hang_on_a_joint_that_steers_something_else():
    parts = (
        *outboard(),
        link("second"),
        joint("shaft", "second", "left_engine", "fixed"),
        thruster("second", None, "second"),
    )
    assert refused(*parts) == (
        "boat.urdf:5: joint 'left_hinge': steers 'left', and the propeller 'second' of 'second', which it does not "
        "steer, moves with it"
    )


def test_the_joint_on_which_a_boat_floats_has_its_name_to_itself():
    parts = (link("left_propeller"), joint("free", "left_propeller"), thruster("left", "free"))
    assert refused(*parts) == ("boat.urdf:4: joint 'free': cannot be named 'free', the name of the boat's free joint")


def test_hinges_that_differ_by_the_namespace_alone_are_told():
    parts = (link("a"), joint("wamv/hinge", "a", "wamv/base_link"), thruster("left", "wamv/hinge", "a"),
             link("b"), joint("hinge", "b", "wamv/base_link"), thruster("right", "hinge", "b"))  # fmt: skip
    assert refused(*parts, hull=link("wamv/base_link", 100)) == (
        "boat.urdf:7: joint 'hinge': has the same name as 'wamv/hinge' without the namespace 'wamv'"
    )


def test_no_thruster_has_the_name_of_the_command_that_steers_another():
    parts = (
        *outboard(),
        link("second"),
        joint("shaft", "second", kind="fixed"),
        thruster("left_angle", None, "second"),
    )
    assert refused(*parts) == (
        "boat.urdf: duplicate name 'left_angle': a thruster, and the command that steers the thruster 'left'"
    )


def test_a_slide_does_not_steer():
    assert refused(
        link("left_propeller"), joint("slide", "left_propeller", kind="prismatic"), thruster("left", "slide")
    ) == ("boat.urdf:4: joint 'slide': is prismatic and cannot steer 'left'; expected revolute or continuous")


@pytest.mark.parametrize("kind", ["fixed", "revolute"])
def test_a_rudder_needs_a_joint_that_turns(kind):
    assert refused(*rudder(kind=kind, limits=(0, 0)), rudders={"rudder": RUDDER}) == (
        "the YAML of boat.urdf: rudders.rudder.joint: the joint 'stock' does not turn"
    )


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"thrusters": {"left": {"propeller": "left_propellor", "mapping": "linear"}}},
         "thrusters.left.propeller: no link named 'left_propellor'; did you mean 'left_propeller'?"),
        ({"thrusters": {"left": {"propeller": "left_propeller", "joint": "x", "mapping": "linear"}}},
         "thrusters.left.joint: no joint named 'x'; known: left_hinge, left_shaft, stock"),
        ({"rudders": {"rudder": {**RUDDER, "joint": "stok"}}},
         "rudders.rudder.joint: no joint named 'stok'; did you mean 'stock'?"),
        ({"rudders": {"left": RUDDER}}, "rudders.left: duplicate name: it is the name of a thruster"),
        ({"rudders": {"rudder": {**RUDDER, "propeller": "right", "propeller_diameter": 0.3}}},
         "rudders.rudder.propeller: no thruster named 'right'; known: left"),
        ({"sensors": [{"type": "imu", "name": "imu", "link": "mast"}]},
         "sensors[0].link: no link named 'mast'; known: base_link, left_engine, left_propeller, blade"),
        ({"sensors": [{"type": kind, "name": "a", "link": "base_link"} for kind in ("imu", "gps")]},
         "sensors[1].name: duplicate name of a sensor, 'a'"),
    ],
)  # fmt: skip
def test_what_the_yaml_gets_wrong_is_told_with_its_key(config, message):
    assert refused(*outboard(), *rudder(), **config) == f"the YAML of boat.urdf: {message}"


def test_links_that_differ_by_the_namespace_alone_are_told():
    parts = (link("wamv/mast"), joint("a", "wamv/mast", "wamv/base_link", "fixed"), link("mast"),
             joint("b", "mast", "wamv/base_link", "fixed"))  # fmt: skip
    assert refused(*parts, hull=link("wamv/base_link", 100)) == (
        "boat.urdf:5: link 'mast': has the same name as 'wamv/mast' without the namespace 'wamv'"
    )


@pytest.mark.parametrize(
    ("kind", "axis", "limits", "pose"),
    [
        ("revolute", "0 0 1", (0.5, 0.5), (0, 0, 1, 0, 0, 0.5)),
        ("revolute", "0 1 0", (-2, -0.5), (0, 0, 1, 0, -0.5, 0)),
        ("revolute", "1 0 0", (-2, 2), (0, 0, 1, 0, 0, 0)),
        ("prismatic", "0 0 -1", (0.25, 0.75), (0, 0, 0.75, 0, 0, 0)),
    ],
)
def test_a_joint_that_cannot_be_at_zero_is_held_at_its_nearest_limit(kind, axis, limits, pose):
    mast = joint("step", "mast", kind=kind, xyz="0 0 1", axis=axis, limits=limits)
    boat = assemble(link("mast"), mast)
    assert boat.parts[1].pose == pytest.approx(pose)
    said = [line for line in boat.warnings if "step" in line]
    place = {0.5: "0.5", -2: "-0.5" if limits[1] < 0 else "zero", 0.25: "0.25"}[limits[0]]
    locked = limits[0] == limits[1]
    assert said == ([] if locked else [f"joint 'step' ({kind}) is not simulated: it stays at {place}"])
