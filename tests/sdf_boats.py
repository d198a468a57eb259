"""Boats as models of Gazebo, for tests: our own, written as those of gz-sim, ArduPilot and VRX are."""

HALL = "<inertial><mass>{0}</mass><inertia><ixx>{1}</ixx><iyy>{2}</iyy><izz>{3}</izz></inertia></inertial>"


def box(name, size, pose="0 0 0 0 0 0", tag="collision", more=""):
    return f'<{tag} name="{name}"><pose>{pose}</pose><geometry><box><size>{size}</size></box></geometry>{more}</{tag}>'


def hulls(length=1.2, beam=0.2, height=0.3, half=0.3):
    """Two floats, seen and felt, and a red deck."""
    size = f"{length} {beam} {height}"
    pair = [(side, f"0 {place} 0 0 0 0") for side, place in (("port", half), ("starboard", -half))]
    shapes = [box(side, size, pose, tag) for side, pose in pair for tag in ("collision", "visual")]
    red = "<material><diffuse>0.8 0.1 0.1</diffuse></material>"
    deck = box("deck", f"{length / 2} {2 * half} 0.02", f"0 0 {height / 2} 0 0 0", "visual", red)
    return "\n".join([*shapes, deck])


def link(name, mass, moments, content="", pose="0 0 0 0 0 0", attributes=""):
    inertial = HALL.format(mass, *moments)
    return f'<link name="{name}"><pose{attributes}>{pose}</pose>{inertial}\n{content}</link>'


def spinning(name, parent, child, axis="1 0 0", pose="", attributes=""):
    """A joint without limits, as gz-sim's files write one."""
    limit = "<limit><lower>-1e16</lower><upper>1e16</upper></limit>"
    return (
        f'<joint name="{name}" type="revolute">{pose}<parent>{parent}</parent><child>{child}</child>'
        f"<axis><xyz{attributes}>{axis}</xyz>{limit}</axis></joint>"
    )


def steering(name, parent, child, pose="", room=1.0):
    return (
        f'<joint name="{name}" type="revolute">{pose}<parent>{parent}</parent><child>{child}</child><axis>'
        f"<xyz>0 0 1</xyz><limit><lower>-{room}</lower><upper>{room}</upper></limit></axis></joint>"
    )


def thruster(joint, most=100, more=""):
    return (
        '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">'
        f"<joint_name>{joint}</joint_name><thrust_coefficient>0.004</thrust_coefficient>"
        f"<max_thrust_cmd>{most}</max_thrust_cmd><min_thrust_cmd>-{most}</min_thrust_cmd>{more}</plugin>"
    )


def fossen(more="", link_name="base_link"):
    """gz-sim's drag, by Fossen's signs."""
    return (
        '<plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">'
        f"<link_name>{link_name}</link_name><xDotU>-3</xDotU><yDotV>-10</yDotV><xU>-12</xU><xUabsU>-25</xUabsU>"
        f"<yV>-60</yV><zW>-120</zW><kP>-15</kP><mQ>-25</mQ><nR>-14</nR>{more}</plugin>"
    )


def sdf(name, *parts, version="1.9"):
    """One element a line: the first part is on line 3."""
    return "\n".join([f'<sdf version="{version}">', f'<model name="{name}">', *parts, "</model>", "</sdf>", ""])


PROPELLER = (0.2, (0.001, 0.001, 0.001))
SENSORS = """<sensor name="imu" type="imu"><update_rate>50</update_rate></sensor>
<sensor name="navsat" type="navsat"><update_rate>10</update_rate><pose>0.2 0 0.3 0 0 0</pose></sensor>
<sensor name="camera" type="camera"><update_rate>5</update_rate><pose degrees="true">0.5 0 0.4 0 15 0</pose>
<camera><horizontal_fov>1.2</horizontal_fov><image><width>64</width><height>48</height></image></camera></sensor>
<sensor name="scan" type="gpu_lidar"><update_rate>10</update_rate><lidar><scan><horizontal><samples>32</samples>
<min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan><range><min>0.5</min><max>30</max></range></lidar>
</sensor>"""

POINTS = "".join(f"<point>{x} {{0}} 0</point>" for x in (0.35, -0.35))
SURFACE = (
    '<plugin filename="libSurface.so" name="vrx::Surface"><link_name>base_link</link_name>'
    "<hull_length>1.2</hull_length><hull_radius>0.12</hull_radius><fluid_level>0</fluid_level><points>{0}</points></plugin>"
)
SIMPLE = (
    '<plugin filename="libSimpleHydrodynamics.so" name="vrx::SimpleHydrodynamics"><link_name>base_link</link_name>'
    "<xDotU>0</xDotU><yDotV>0</yDotV><nDotR>0</nDotR><xU>12</xU><xUU>25</xUU><yV>60</yV><zW>120</zW><kP>15</kP>"
    "<mQ>25</mQ><nR>14</nR></plugin>"
)


def catamaran():
    """As VRX 3's boats: hulls of points, positive drag, engines that steer and propellers on them, four sensors."""
    parts = []
    for side, place in (("left", 0.3), ("right", -0.3)):
        parts += [
            link(f"{side}_engine_link", 0.5, (0.01, 0.01, 0.01), pose=f"-0.6 {place} 0 0 0 0"),
            steering(f"{side}_chassis_engine_joint", "base_link", f"{side}_engine_link"),
            link(f"{side}_propeller_link", *PROPELLER, pose=f"-0.65 {place} -0.15 0 0 0"),
            spinning(f"{side}_engine_propeller_joint", f"{side}_engine_link", f"{side}_propeller_link"),
            thruster(f"{side}_engine_propeller_joint", 60, f"<topic>thrusters/{side}/thrust</topic>"),
        ]
    water = [SURFACE.format(POINTS.format(place)) for place in (0.3, -0.3)]
    hull = link("base_link", 25, (2.5, 4, 5.5), hulls() + SENSORS + '<sensor name="a" type="custom" gz:type="b"/>')
    return sdf("catamaran", hull, *parts, *water, SIMPLE)


CHANNEL = (
    '<control channel="{0}"><jointName>{1}</jointName><multiplier>{2}</multiplier><offset>-0.5</offset>'
    "<servo_min>1100</servo_min><servo_max>1900</servo_max><type>{3}</type></control>"
)


def skiff():
    """As ArduPilot's boats: propellers whose links are turned, their force by the channels of the autopilot."""
    parts, channels = [], []
    for channel, (side, place) in enumerate((("port", 0.3), ("stbd", -0.3))):
        parts += [
            link(f"motor_{side}_link", *PROPELLER, pose=f"-0.5 {place} -0.1 -90 0 90", attributes=' degrees="true"'),
            spinning(f"motor_{side}_joint", "base_link", f"motor_{side}_link", "0 0 -1"),
            thruster(f"motor_{side}_joint", 1000, "<namespace>skiff</namespace>"),
        ]
        channels.append(CHANNEL.format(2 * channel, f"motor_{side}_joint", 70, "COMMAND"))
    pilot = f'<plugin name="ArduPilotPlugin" filename="ArduPilotPlugin">{"".join(channels)}</plugin>'
    return sdf("skiff", link("base_link", 25, (2.5, 4, 5.5), hulls() + SENSORS), *parts, fossen(), pilot)


CLASSIC = """<plugin name="water" filename="libusv_gazebo_dynamics_plugin.so"><bodyName>base_link</bodyName>
<waterLevel>0</waterLevel><xDotU>0</xDotU><yDotV>0</yDotV><nDotR>0</nDotR><xU>12</xU><xUU>25</xUU><yV>60</yV><zW>120</zW>
<kP>15</kP><mQ>25</mQ><nR>14</nR><hullRadius>0.12</hullRadius><boatWidth>0.6</boatWidth><boatLength>1.2</boatLength>
<length_n>2</length_n></plugin>
<plugin name="thrust" filename="libusv_gazebo_thrust_plugin.so"><cmdTimeout>1.0</cmdTimeout>%s</plugin>"""
ENGINE = """<thruster><linkName>{0}_propeller_link</linkName><propJointName>{0}_propeller_joint</propJointName>
<cmdTopic>thrusters/{0}_thrust_cmd</cmdTopic><mappingType>0</mappingType><maxCmd>1</maxCmd><maxForceFwd>45</maxForceFwd>
<maxForceRev>-25</maxForceRev></thruster>"""


def classic():
    """In SDF 1.6 with the plugins of VRX for Gazebo classic."""
    parts = []
    for side, place in (("left", 0.3), ("right", -0.3)):
        parts += [
            link(f"{side}_propeller_link", *PROPELLER, pose=f"-0.6 {place} -0.1 0 0 0"),
            spinning(f"{side}_propeller_joint", "base_link", f"{side}_propeller_link"),
        ]
    plugins = CLASSIC % "".join(ENGINE.format(side) for side in ("left", "right"))
    hull = link("base_link", 25, (2.5, 4, 5.5), hulls() + SENSORS)
    return sdf("classic", hull, *parts, plugins, version="1.6")


def outboard():
    """In SDF 1.11: one engine that steers about a joint of its own, poses in the frames of others."""
    parent = ' relative_to="base_link"'
    steer = steering("steer", "base_link", "engine", '<pose relative_to="transom">0 0 0.1 0 0 0</pose>', 0.6)
    controller = (
        '<plugin filename="gz-sim-joint-position-controller-system" name="gz::sim::systems::JointPositionController">'
        "<joint_name>steer</joint_name></plugin>"
    )
    return sdf(
        "outboard",
        link("base_link", 25, (2.5, 4, 5.5), hulls() + SENSORS),
        f'<frame name="transom" attached_to="base_link"><pose{parent}>-0.6 0 0 0 0 0</pose></frame>',
        link("engine", 1, (0.02, 0.02, 0.02), pose="-0.05 0 0 0 0 0", attributes=' relative_to="transom"'),
        steer,
        link("screw", *PROPELLER, pose="0 0 -0.15 0 0 0", attributes=' relative_to="engine"'),
        spinning("drive", "engine", "screw", "1 0 0", attributes=' expressed_in="__model__"'),
        thruster("drive", 80, "<topic>main/thrust</topic>"),
        fossen(),
        controller,
        version="1.11",
    )


def raft():
    """In SDF 1.4: a hull and a thruster, and nothing that says how it floats."""
    return sdf(
        "raft",
        link("base_link", 60, (6, 9, 14), box("hull", "1.6 0.9 0.25") + box("hull", "1.6 0.9 0.25", tag="visual")),
        link("screw", *PROPELLER, pose="-0.8 0 -0.1 0 0 1.570796326794897"),
        spinning("drive", "base_link", "screw"),  # in SDF 1.4 the axis is that of the model
        thruster("drive", 50),
        version="1.4",
    )


BOATS = {"catamaran": catamaran, "skiff": skiff, "classic": classic, "outboard": outboard, "raft": raft}
"""Boats by their names."""
