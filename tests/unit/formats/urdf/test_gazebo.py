"""Gazebo's tags: thrusters, water, wind and sensors, as VRX's generators of both generations write them."""

import math
import re
from pathlib import Path

import pytest
from pydantic import TypeAdapter

from urdf_boats import assemble, joint, link
from vrx_mj.config.dynamics import HullConfig, HydrodynamicsConfig, ThrusterConfig
from vrx_mj.config.sensors import (
    BallShooterConfig,
    CameraConfig,
    ErrorModel,
    GpsConfig,
    LidarConfig,
    P3dConfig,
    PingerConfig,
    SensorConfig,
)
from vrx_mj.formats.urdf import gazebo_sensors
from vrx_mj.formats.urdf.elements import FIELDS
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.frames import apply, rotation

GOLDEN = Path(__file__).parents[3] / "golden" / "urdf" / "wamv.urdf"
RIGHT = math.radians(90)

HULL = '<link name="{0}base_link"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'


def boat(tags, *links, namespace="", poses=None):
    """A boat with these links fixed to its hull, and Gazebo's tags."""
    prefix = f"{namespace}/" if namespace else ""
    parts = [HULL.format(prefix)]
    for name in links:
        xyz, rpy = (poses or {}).get(name, ("0 0 0", "0 0 0"))
        parts.append(f'<link name="{prefix}{name}"/><joint name="{prefix}{name}_joint" type="fixed">'
                     f'<origin xyz="{xyz}" rpy="{rpy}"/><parent link="{prefix}base_link"/>'
                     f'<child link="{prefix}{name}"/></joint>')  # fmt: skip
    return read_urdf(f'<robot name="boat">\n{"".join(parts)}\n{tags}\n</robot>', Path("boat.urdf"))


def gazebo(tags, *links, **kinds):
    return boat(tags, *links, **kinds).gazebo


def plugin(filename, content=""):
    return f'<gazebo><plugin name="p" filename="{filename}">{content}</plugin></gazebo>'


def sensor(kind, content, link="eye_link", attributes=""):
    return f'<gazebo reference="{link}"><sensor type="{kind}" name="eye_sensor"{attributes}>{content}</sensor></gazebo>'


@pytest.fixture(scope="module")
def wamv():
    return read_urdf(GOLDEN.read_text(encoding="utf-8"), GOLDEN).gazebo


def test_a_file_of_vrx_leaves_nothing_undone(wamv):
    assert wamv.warnings == []


def test_thrusters_are_vrxs(wamv):
    drive = ThrusterConfig(mapping="glf", max_command=1, max_force_forward=250, max_force_reverse=-100, timeout=1,
                           max_angle=math.pi / 2)  # fmt: skip
    assert [(thruster.name, thruster.propeller_link, thruster.propeller_joint, thruster.engine_joint)
            for thruster in wamv.thrusters] == [
        ("left", "wamv/left_propeller_link", "wamv/left_engine_propeller_joint", "wamv/left_chasis_engine_joint"),
        ("right", "wamv/right_propeller_link", "wamv/right_engine_propeller_joint", "wamv/right_chasis_engine_joint"),
    ]  # fmt: skip
    assert {thruster.drive for thruster in wamv.thrusters} == {drive}
    assert {(thruster.kp, thruster.kd) for thruster in wamv.thrusters} == {(300, 20)}


def test_water_is_vrxs_with_the_plugins_defaults_for_what_is_not_written(wamv):
    assert wamv.hydrodynamics == HydrodynamicsConfig(
        water_level=0,
        water_density=997.8,
        hull_radius=0.213,
        boat_width=2.4,
        boat_length=4.9,
        length_n=2,
        added_mass=(0, 0, 0.1, 0.1, 0.1, 0),
        drag_linear=(51.3, 40, 500, 50, 50, 400),
        drag_quadratic=(72.4, 0, 0, 0, 0, 0),
    )


def test_sensors_are_where_and_what_vrx_makes_them(wamv):
    found = {sensor.name: sensor for sensor in wamv.sensors}
    camera = found["front_left_camera"]
    assert camera.pose == pytest.approx((0.75, 0.1, 1.5, 0, math.radians(15), 0))
    assert camera.model_copy(update={"pose": (0.0,) * 6}) == CameraConfig(
        name="front_left_camera",
        link="front_left_camera_link",
        frame="front_left_camera_link_optical",
        topic="sensors/cameras/front_left_camera",
    )  # VRX's camera is the default one
    lidar = found["lidar_wamv"]
    assert lidar.pose == pytest.approx((0.7, 0, 1.8, 0, math.radians(8), 0))
    assert lidar.model_copy(update={"pose": (0.0,) * 6}) == LidarConfig(
        name="lidar_wamv",
        link="lidar_wamv_link",
        frame="lidar_wamv_link",
        topic="sensors/lidars/lidar_wamv",
        azimuth=(-math.pi, math.pi),
    )
    assert (lidar.samples, lidar.rings, lidar.rate, lidar.noise, lidar.range) == (1875, 16, 10, 0.01, (0.1, 130))
    gps = found["gps_wamv"]
    assert (gps.rate, gps.pose, gps.topic) == (15, (-0.85, 0, 1.3, 0, 0, 0), "sensors/gps/gps")
    assert gps.position.noise == gps.velocity.noise == (0, 0, 0)
    imu = found["imu_wamv"]
    assert (imu.rate, imu.pose, imu.topic) == (15, (0.3, -0.2, 1.3, 0, 0, 0), "sensors/imu/imu")
    assert imu.acceleration.drift_frequency == imu.angular_velocity.drift_frequency == (0.00027, 0.00027, 0.000027)
    assert found["p3d_wamv"] == P3dConfig(
        name="p3d_wamv", link="base_link", frame="map", topic="sensors/position/p3d_wamv"
    )
    assert found["pinger"] == PingerConfig(
        name="pinger", link="pinger", frame="pinger", pose=(1, 0, -1, 0, 0, 0), topic="sensors/pingers/pinger"
    )
    shooter = found["ball_shooter"]
    assert shooter.pose == pytest.approx((0.5296, -0.3, 1.407877, 0, math.radians(-20), 0))
    assert (shooter.shots, shooter.muzzle, shooter.topic) == (4, (0.14, 0, 0), "shooters/ball_shooter")
    assert shooter.impulse == pytest.approx(0.3)  # 300 N for 1 ms


def test_sensors_survive_a_compiled_world(wamv):
    for item in wamv.sensors:
        assert TypeAdapter(SensorConfig).validate_json(item.model_dump_json()) == item


def test_another_namespace_changes_nothing_but_the_links(wamv):
    """Even where VRX writes `wamv` whatever the namespace."""
    text = re.sub(r"\bwamv/", "defender_a/", GOLDEN.read_text(encoding="utf-8").replace("_wamv/", "_WAMV/"))
    text = text.replace("_WAMV/", "_wamv/")
    text = text.replace("<frameId>defender_a/pinger", "<frameId>wamv/pinger")
    text = text.replace("<frame>defender_a/ball_shooter", "<frame>wamv/ball_shooter")
    other = read_urdf(text, GOLDEN).gazebo
    assert other.sensors == wamv.sensors
    assert [thruster.name for thruster in other.thrusters] == ["left", "right"]
    assert other.thrusters[0].propeller_link == "defender_a/left_propeller_link"


def test_cora_pushes_linearly_and_does_not_steer():
    thruster = """<robotNamespace>cora</robotNamespace><thruster><linkName>left_propeller_link</linkName>
        <engineJointName>left_propeller_link_joint</engineJointName><cmdTopic>thrusters/left_thrust_cmd</cmdTopic>
        <angleTopic>thrusters/left_thrust_angle</angleTopic><enableAngle>false</enableAngle>
        <mappingType>0</mappingType><maxForceFwd>120000.0</maxForceFwd><maxForceRev>-50000.0</maxForceRev></thruster>"""
    (found,) = gazebo(plugin("libusv_gazebo_thrust_plugin.so", thruster), "left_propeller_link").thrusters
    assert (found.name, found.engine_joint, found.propeller_joint) == ("left", None, None)
    assert (found.drive.mapping, found.drive.max_force_forward, found.drive.max_force_reverse) == (
        "linear",
        120000,
        -50000,
    )


def test_a_thruster_of_which_little_is_said_is_the_plugins():
    tags = plugin("libusv_gazebo_thrust_plugin.so", "<thruster><linkName>stern_propeller_link</linkName></thruster>")
    (found,) = gazebo(tags, "stern_propeller_link", namespace="my").thrusters  # the namespace may be left out
    assert (found.name, found.propeller_link) == ("stern", "my/stern_propeller_link")
    assert found.drive == ThrusterConfig(mapping="linear")


def test_older_files_do_not_name_the_hinge_that_steers():
    hinge = """<link name="base_link"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
        <link name="engine"/><link name="screw"/>
        <joint name="hinge" type="revolute"><parent link="base_link"/><child link="engine"/>
        <limit lower="-3" upper="3" effort="10" velocity="10"/></joint>
        <joint name="shaft" type="continuous"><parent link="engine"/><child link="screw"/></joint>"""
    thruster = "<thruster><linkName>screw</linkName><angleTopic>left_thrust_angle</angleTopic></thruster>"
    text = f"<robot>{hinge}{plugin('libusv_gazebo_thrust_plugin.so', thruster)}</robot>"
    (found,) = read_urdf(text, Path("boat.urdf")).gazebo.thrusters
    assert (found.name, found.engine_joint) == ("screw", "hinge")


def test_wind_takes_the_coefficients_of_this_boat():
    other = "<wind_obj><name>buoy</name><link_name>base</link_name><coeff_vector>1 1 1</coeff_vector></wind_obj>"
    own = (
        "<wind_obj><name>b</name><link_name>wamv/base_link</link_name><coeff_vector>.5 .5 .33</coeff_vector></wind_obj>"
    )
    found = gazebo(plugin("libusv_gazebo_wind_plugin.so", other + own), namespace="wamv3")
    assert found.wind == (0.5, 0.5, 0.33)
    old = plugin("libusv_gazebo_wind_plugin.so", "<wind_coeff_vector>0.4 0.5 0.6 </wind_coeff_vector>")
    assert gazebo(old).wind == (0.4, 0.5, 0.6)


def test_errors_of_hectors_plugins_are_read():
    content = """<bodyName>eye_link</bodyName><updateRate>50</updateRate><topicName>/imu/data</topicName>
        <accelOffset>0.1 0.2 0.3</accelOffset><accelDrift>0.01</accelDrift><rateGaussianNoise>1 2 3</rateGaussianNoise>
        <yawGaussianNoise>0.5</yawGaussianNoise>"""
    (imu,) = gazebo(plugin("libhector_gazebo_ros_imu.so", content), "eye_link").sensors
    assert (imu.name, imu.frame, imu.topic, imu.rate) == ("eye", "eye_link", "imu", 50)
    assert (imu.acceleration.offset, imu.acceleration.drift) == ((0.1, 0.2, 0.3), (0.01,) * 3)
    assert imu.acceleration.drift_frequency == pytest.approx((1 / 3600,) * 3)  # Hector's default: an hour
    assert (imu.angular_velocity.noise, imu.heading.noise) == ((1, 2, 3), (0.5,) * 3)


def test_a_planar_lidar_scans():
    ray = """<update_rate>10</update_rate><ray><scan><horizontal><samples>256</samples><resolution>1</resolution>
        <min_angle>-1.0472</min_angle><max_angle>1.0472</max_angle></horizontal></scan>
        <range><min>0.2</min><max>70</max><resolution>0.02</resolution></range></ray>
        <plugin name="multibeam_simulator" filename="libgazebo_ros_gpu_laser.so">
        <topicName>sensors/lidars/eye/scan</topicName><frameName>eye_link</frameName></plugin>"""
    (lidar,) = gazebo(sensor("gpu_ray", ray), "eye_link").sensors
    assert lidar == LidarConfig(
        name="eye", link="eye_link", frame="eye_link", topic="sensors/lidars/eye", output="scan", rings=1, samples=256,
        azimuth=(-1.0472, 1.0472), elevation=(0.0, 0.0), range=(0.2, 70.0), resolution=0.02, noise=0.0,
    )  # fmt: skip


def test_water_reflects_where_a_lidar_says_so():
    ray = """<update_rate>10</update_rate><ray><scan><horizontal/></scan></ray>
        <plugin name="p" filename="libgazebo_ros_velodyne_laser.so"><sea_returns>true</sea_returns>
        <gaussianNoise>0.03</gaussianNoise><max_range>40</max_range></plugin>"""
    (lidar,) = gazebo(sensor("ray", ray), "eye_link").sensors
    assert (lidar.sea_returns, lidar.noise, lidar.range, lidar.output) == (True, 0.03, (0.0, 40.0), "points")


def test_a_sensors_own_pose_is_in_its_links():
    """A link turned to port, and a sensor one metre ahead of it that looks up."""
    tags = sensor("imu", "<update_rate>9</update_rate><pose>1 0 0 0 -1.5 0</pose>")
    (imu,) = gazebo(tags, "eye_link", poses={"eye_link": ("2 0 5", f"0 0 {RIGHT}")}).sensors
    assert imu.pose == pytest.approx((2, 1, 5, 0, -1.5, RIGHT))


def test_two_sensors_of_one_link_have_names_of_their_own():
    content = "<update_rate>9</update_rate>"
    tags = f"""<gazebo reference="eye_link"><sensor type="imu" name="first">{content}</sensor>
    <sensor type="imu" name="second">{content}</sensor><sensor type="imu" name="second">{content}</sensor></gazebo>"""
    found = gazebo(tags, "eye_link")
    assert [item.name for item in found.sensors] == ["first", "second", "second_2"]
    assert [*map(str, found.warnings)] == [
        (
            "boat.urdf:4: gazebo 'eye_link' / sensor 'second': duplicate name 'second'; "
            "this sensor is renamed to 'second_2'"
        ),
    ]


@pytest.mark.parametrize(
    ("tags", "message"),
    [
        (plugin("libmy_autopilot.so"), "gazebo / plugin 'p': the plugin libmy_autopilot.so is not simulated"),
        ('<gazebo><plugin name="p"/></gazebo>', "gazebo / plugin 'p': the plugin without a filename is not simulated"),
        (
            sensor("sonar", ""),
            "gazebo 'eye_link' / sensor 'eye_sensor': sensors of type 'sonar' are not simulated",
        ),
        (
            '<gazebo reference="mast"/>',
            "gazebo 'mast': no link or joint named 'mast'; the element is ignored",
        ),
        (
            plugin("libgazebo_ros_p3d.so", "<bodyName>eye_link</bodyName><topicName>truth</topicName>"),
            "gazebo / plugin 'p': has no updateRate; 100 Hz is used, not every step",
        ),
        (
            plugin("libgazebo_ros_p3d.so", "<bodyName>eye_link</bodyName><topicName>truth</topicName>"
                   "<updateRate>9</updateRate><xyzOffset>0 0 1</xyzOffset>"),
            "gazebo / plugin 'p': xyzOffset is ignored",
        ),
        (
            plugin("libball_shooter_plugin.so", "<topic>shooters/gun/fire</topic>"),
            "gazebo / plugin 'p': no link named 'gun_launcher_link' to launch from: the root link is used",
        ),
        (
            sensor("camera", '<update_rate>9</update_rate><camera/><plugin name="c" filename="libgazebo_ros_camera.so">'
                   "<distortionK1>0.1</distortionK1></plugin>"),
            "gazebo 'eye_link' / sensor 'eye_sensor' / plugin 'c': lens distortion is not simulated",
        ),
        (plugin("libusv_gazebo_thrust_plugin.so"), "gazebo / plugin 'p': it has no <thruster>"),
        (
            plugin("libusv_gazebo_dynamics_plugin.so", "<bodyName>eye_link</bodyName>"),
            "gazebo / plugin 'p': the water acts on 'base_link', the root link, not on 'eye_link'",
        ),
        (
            plugin("libball_shooter_plugin.so", "<projectile><link_name>eye_link</link_name><frame>eye_link</frame>"
                   "<pose>0.1 0 0 0 0.5 0</pose></projectile><topic>shooters/eye/fire</topic>"),
            "gazebo / plugin 'p': the angles of the projectile's pose are ignored",
        ),
        (
            sensor("gpu_ray", "<update_rate>9</update_rate><ray><scan><horizontal><samples>256</samples></horizontal>"
                   "<vertical><samples>4</samples></vertical></scan></ray>"
                   '<plugin name="m" filename="libgazebo_ros_gpu_laser.so"/>'),
            "gazebo 'eye_link' / sensor 'eye_sensor': a scan has one ring: the other 3 are ignored",
        ),
    ],
)  # fmt: skip
def test_what_is_not_done_is_listed_with_its_line(tags, message):
    assert [*map(str, gazebo(tags, "eye_link").warnings)] == [f"boat.urdf:3: {message}"]


@pytest.mark.parametrize(
    ("content", "water"),
    [
        ("<uniform_fluid_density>1020</uniform_fluid_density>", {"water_density": 1020.0}),
        ("<graded_buoyancy><default_density>1021</default_density></graded_buoyancy>", {"water_density": 1021.0}),
        ("<graded_buoyancy/>", {"water_density": 1000.0}),
        ("", {}),
    ],
)
def test_gz_sim_s_buoyancy_says_how_dense_the_water_is(content, water):
    assert gazebo(plugin("gz-sim-buoyancy-system", content)).water == water


def test_publishers_and_looks_are_no_news():
    tags = plugin("libgazebo_ros_joint_state_publisher.so") + (
        '<gazebo reference="eye_link"><material>Gazebo/Black</material><mu1>0.2</mu1></gazebo>'
        '<gazebo reference="eye_link_joint"><preserveFixedJoint>true</preserveFixedJoint></gazebo>'
    )
    assert gazebo(tags, "eye_link").warnings == []


def test_a_boat_without_tags_has_nothing():
    found = gazebo("")
    assert (found.thrusters, found.hydrodynamics, found.wind, found.sensors, found.warnings) == ([], None, None, [], [])


def test_a_receiver_on_the_root_link_has_the_plugins_name():
    (gps,) = gazebo(
        plugin("libhector_gazebo_ros_gps.so", "<bodyName>base_link</bodyName><updateRate>5</updateRate>")
    ).sensors
    assert gps == GpsConfig(
        name="gps", link="base_link", frame="base_link", rate=5.0, topic="sensors/gps/gps",
        position={"drift_frequency": (1 / 3600,) * 3}, velocity={"drift_frequency": (1 / 3600,) * 3},
    )  # fmt: skip


# Gazebo's tags as VRX 3 writes them: sensors, thrusters, drag and hulls


NEWER = """
<gazebo><plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">
  <joint_name>wamv/left_propeller_link_joint</joint_name><max_thrust_cmd>2353.5</max_thrust_cmd>
  <namespace>wamv</namespace><topic>thrusters/left/thrust</topic></plugin>
<plugin filename="gz-sim-joint-position-controller-system" name="gz::sim::systems::JointPositionController"/></gazebo>
<gazebo>
  <plugin filename="libSurface.so" name="vrx::Surface"><link_name>wamv/base_link</link_name>
  <hull_length>4.9</hull_length><hull_radius>0.213</hull_radius>
  <points><point>0.6 1.03 0</point><point>-1.4 1.03 0</point></points></plugin>
  <plugin filename="libSurface.so" name="vrx::Surface"><link_name>wamv/base_link</link_name>
  <hull_length>4.9</hull_length><hull_radius>0.213</hull_radius>
  <points><point>0.6 -1.03 0</point><point>-1.4 -1.03 0</point></points></plugin>
  <plugin filename="libSimpleHydrodynamics.so" name="vrx::SimpleHydrodynamics"><link_name>wamv/base_link</link_name>
  <xDotU>0</xDotU><yDotV>0</yDotV><nDotR>0</nDotR><xU>100</xU><xUU>150</xUU><yV>100</yV><yVV>100</yVV><zW>500</zW>
  <kP>300</kP><kPP>600</kPP><mQ>900</mQ><mQQ>900</mQQ><nR>800</nR><nRR>800</nRR></plugin></gazebo>
<gazebo><plugin filename="gz-sim-odometry-publisher-system" name="gz::sim::systems::OdometryPublisher">
  <dimensions>3</dimensions><odom_publish_frequency>10.0</odom_publish_frequency><odom_frame>map</odom_frame>
  <robot_base_frame>wamv/base_link</robot_base_frame></plugin></gazebo>
<gazebo reference="wamv/eye_link"><sensor type="camera" name="eye_sensor"><update_rate>30</update_rate><camera>
  <horizontal_fov>1.3962634</horizontal_fov><image><width>1280</width><height>720</height></image>
  <clip><near>0.05</near><far>400</far></clip><noise><type>gaussian</type><stddev>0.007</stddev></noise></camera>
  </sensor></gazebo>
<gazebo reference="wamv/gps_link"><sensor type="navsat" name="navsat"><always_on>1</always_on>
  <update_rate>20</update_rate></sensor></gazebo>
<gazebo reference="wamv/imu_link"><sensor type="imu" name="imu_sensor"><update_rate>100</update_rate><imu>
  <angular_velocity><x><noise type="gaussian"><stddev>0.009</stddev><bias_mean>0.00075</bias_mean>
  <bias_stddev>0.005</bias_stddev><dynamic_bias_stddev>0.00002</dynamic_bias_stddev>
  <dynamic_bias_correlation_time>400</dynamic_bias_correlation_time></noise></x></angular_velocity></imu></sensor></gazebo>
<gazebo reference="wamv/lidar_link"><sensor type="gpu_ray" name="lidar_sensor"><update_rate>10</update_rate><ray><scan>
  <horizontal><samples>1875.0</samples><min_angle>-3.14</min_angle><max_angle>3.14</max_angle></horizontal>
  <vertical><samples>16</samples><min_angle>-0.26</min_angle><max_angle>0.26</max_angle></vertical></scan>
  <range><min>0.1</min><max>130</max></range></ray></sensor></gazebo>
<gazebo><plugin filename="libAcousticPingerPlugin.so" name="vrx::AcousticPingerPlugin"><position>-528 191 -2</position>
  <topic>/wamv/sensors/acoustics/receiver/range_bearing</topic><frame_id>wamv/pinger</frame_id>
  <range_noise><noise><stddev>3.0</stddev></noise></range_noise></plugin></gazebo>
<gazebo><plugin name="vrx::BallShooterPlugin" filename="libBallShooterPlugin.so"><projectile>
  <frame>wamv/shooter_launcher_link</frame><pose>0.14 0 0 0 0 0</pose></projectile><num_shots>4</num_shots>
  <shot_force>65</shot_force><topic>wamv/shooters/shooter/fire</topic></plugin></gazebo>
<gazebo reference="wamv/base_link"><sensor name="contact_sensor" type="contact"><update_rate>5</update_rate></sensor>
</gazebo><gazebo><plugin filename="libgz-sim-pose-publisher-system.so" name="gz::sim::systems::PosePublisher"/></gazebo>
"""
LINKS = ("left_propeller_link", "eye_link", "eye_link_optical", "gps_link", "imu_link", "lidar_link", "receiver",
         "shooter_launcher_link")  # fmt: skip


@pytest.fixture(scope="module")
def newer():
    return gazebo(NEWER, *LINKS, namespace="wamv")


def test_newer_vrxs_sensors_are_read(newer):
    found = {item.name: item for item in newer.sensors}
    assert [(item.type, item.name, item.link, item.frame, item.topic) for item in newer.sensors] == [
        ("p3d", "ground_truth_odometry", "base_link", "map", "sensors/position/ground_truth_odometry"),
        ("camera", "eye", "eye_link", "eye_link_optical", "sensors/cameras/eye"),
        ("gps", "gps", "gps_link", "gps_link", "sensors/gps/gps"),
        ("imu", "imu", "imu_link", "imu_link", "sensors/imu/imu"),
        ("lidar", "lidar", "lidar_link", "lidar_link", "sensors/lidars/lidar"),
        ("pinger", "receiver", "receiver", "pinger", "sensors/acoustics/receiver"),
        ("ball_shooter", "shooter", "shooter_launcher_link", "shooter_launcher_link", "shooters/shooter"),
    ]
    assert (found["eye"].far, found["gps"].rate, found["imu"].rate) == (400, 20, 100)
    rates = found["imu"].angular_velocity
    assert (rates.noise[0], rates.offset[0], rates.noise[1]) == (0.009, 0.00075, 0)
    assert rates.drift[0] == pytest.approx(math.hypot(0.005, 2e-5 * math.sqrt(200)))  # stationary deviation, by hand
    assert rates.drift[0] * math.sqrt(2 * rates.drift_frequency[0]) == pytest.approx(2e-5)  # wander in 1 s
    assert found["eye"].info == "vrx3"  # of gz sim itself, without a plugin
    assert found["receiver"].beacon == (-528, 191, -2)
    assert (found["lidar"].output, found["lidar"].samples, found["lidar"].rings) == ("points", 1875, 16)
    assert found["shooter"].impulse == pytest.approx(0.26)  # 65 N for 4 ms
    assert (found["receiver"].range_noise, found["receiver"].bearing_noise) == (3, 0)


def test_newer_vrxs_forces_are_read(newer):
    (thruster,) = newer.thrusters
    assert (thruster.name, thruster.propeller_link) == ("left", "wamv/left_propeller_link")
    assert (thruster.drive.max_force_forward, thruster.drive.max_force_reverse) == (2353.5, -1000)
    assert thruster.drive.timeout == 0
    water = newer.hydrodynamics
    assert (water.boat_width, water.boat_length, water.hull_radius) == (2.06, 4.9, 0.213)
    assert [(hull.length, hull.radius) for hull in water.hulls] == [(4.9, 0.213)] * 2
    assert [hull.points for hull in water.hulls] == [
        ((0.6, side * 1.03, 0), (-1.4, side * 1.03, 0)) for side in (1, -1)
    ]
    assert water.drag_linear == (100, 100, 500, 300, 900, 800)
    assert water.drag_quadratic == (150, 100, 0, 600, 900, 800)
    assert [*map(str, newer.warnings)] == [
        (
            "boat.urdf:4: gazebo / plugin 'gz::sim::systems::Thruster': commands are newtons only in profile "
            "vrx3, otherwise fractions of the maximum thrust, -1 to 1"
        ),
    ]


SURFACE = """<gazebo><plugin filename="libSurface.so" name="vrx::Surface">{}</plugin></gazebo>"""
DRAG = """<gazebo><plugin filename="libSimpleHydrodynamics.so" name="vrx::SimpleHydrodynamics"/></gazebo>"""


def test_newer_vrxs_hulls_need_not_be_alike():
    """RoboBoat's trimaran, with the plugin's defaults for what the middle hull leaves out."""
    middle = SURFACE.format("<points><point>0.94 0 0.1</point></points><fluid_level>0.1</fluid_level>")
    side = SURFACE.format(
        "<hull_length>0.8</hull_length><hull_radius>0.075</hull_radius><points><point>0 0.4 0</point></points>"
    )
    found = gazebo(middle + side + DRAG)
    assert [(hull.length, hull.radius, hull.points) for hull in found.hydrodynamics.hulls] == [
        (4.9, 0.213, ((0.94, 0, 0.1),)),
        (0.8, 0.075, ((0, 0.4, 0),)),
    ]
    assert (found.hydrodynamics.water_level, found.hydrodynamics.water_density) == (0.1, 997.7735)
    assert [*map(str, found.warnings)] == [
        (
            "boat.urdf:3: gazebo / plugin 'vrx::Surface': the fluid_level and fluid_density of this hull apply to all "
            "hulls"
        ),
    ]


def test_a_newer_hull_without_points_carries_nothing():
    found = gazebo(SURFACE.format("<points><point>0.94 0</point></points>") + DRAG)
    assert found.hydrodynamics is None
    assert [*map(str, found.warnings)] == [
        (
            "boat.urdf:3: gazebo / plugin 'vrx::Surface': expected three numbers in each of its <points>; this hull "
            "has no buoyancy"
        ),
        (
            "boat.urdf:3: gazebo / plugin 'vrx::SimpleHydrodynamics': no hull (Surface plugin) with points "
            "matches it; the collision shapes displace water"
        ),
    ]


# Thrusters in the tags of the UUV simulator and of freefloating_gazebo, as the forces that they give


UUV, FREE = "libuuv_thruster_ros_plugin.so", "libfreefloating_gazebo_control.so"
NAMES = "<linkName>thruster_0</linkName><jointName>thruster_0_joint</jointName><thrusterID>0</thrusterID>"


def boat_with(filename, content, kind="continuous", axis="1 0 0", rpy="0 0 0", limits=None):
    shaft = joint("thruster_0_joint", "thruster_0", xyz="-0.5 -0.4 -0.2", kind=kind, axis=axis, rpy=rpy, limits=limits)
    return assemble(link("thruster_0", 0.1), shaft, plugin(filename, content))


@pytest.mark.parametrize(
    ("content", "forward", "reverse"),
    [
        ("<thrustMax>60</thrustMax><thrustMin>-35</thrustMin>", 60, -35),
        ("<thrustMax>60</thrustMax>", 60, -60),
        ("<clampMax>100</clampMax><conversion><rotorConstant>0.004</rotorConstant></conversion>", 40, -40),
        ("<conversion><inputValues>-9 0 9</inputValues><outputValues>-5 0 7</outputValues></conversion>", 7, -7),
        ("<thrustMax>0</thrustMax><thrustMin>0</thrustMin>", 250, -250),
    ],
)
def test_the_largest_thrust_of_the_uuv_simulator(content, forward, reverse):
    (thruster,) = boat_with(UUV, NAMES + content).thrusters
    assert (thruster.name, thruster.link, thruster.joint) == ("thruster_0", "thruster_0", None)
    assert (thruster.drive.max_force_forward, thruster.drive.max_force_reverse) == (forward, reverse)
    assert thruster.pose[:3] == (-0.5, -0.4, -0.2)


@pytest.mark.parametrize(("axis", "direction"), [("1 0 0", (1, 0, 0)), ("0 0 2", (0, 0, 1)), ("-1 0 0", (-1, 0, 0))])
def test_the_uuv_simulators_thrust_is_along_the_axis_of_the_joint(axis, direction):
    (thruster,) = boat_with(UUV, NAMES, axis=axis).thrusters
    assert thruster.direction == direction


def test_a_thruster_of_freefloating_pushes_against_its_z_axis_and_steers_on_its_joint():
    """usv_sim's airboat: its z axis points aft, and its joint's axis, x, upward."""
    content = "<thruster><name>thruster_0</name><effortUnderWater>80</effortUnderWater></thruster>"
    boat = boat_with(FREE, content, kind="revolute", rpy=f"0 {-1.5707963267948966} 0", limits=(-0.7, 0.7))
    (thruster,) = boat.thrusters
    assert (thruster.name, thruster.joint, thruster.drive.max_angle) == ("thruster_0", "thruster_0_joint", 0.7)
    assert (thruster.drive.max_force_forward, thruster.drive.max_force_reverse) == (80, -80)
    assert apply(rotation(*thruster.pose[3:]), thruster.direction) == pytest.approx((1, 0, 0))
    assert apply(rotation(*thruster.pose[3:]), (0, 0, 1)) == pytest.approx((0, 0, 1))


@pytest.mark.parametrize(
    ("filename", "content", "note"),
    [
        (
            UUV,
            "<linkName>screw</linkName>",
            "no link named 'screw'; known: base_link, thruster_0; this thruster is not ",
        ),
        (FREE, "<thruster><name>screw</name></thruster>", "no link named 'screw'; known: base_link, thruster_0; this "),
        (
            FREE,
            "<thruster><map>1 0 0 0 0 0</map></thruster>",
            "a thruster with a <map> has no link and is not simulated",
        ),
        (UUV, NAMES, "without thrustMax and a maximum input, the maximum thrust is 250 N"),
        (UUV, NAMES, "commands are fractions of the maximum thrust, -1 to 1"),
    ],
)
def test_what_a_file_does_not_say_is_said(filename, content, note):
    assert any(note in line for line in map(str, boat_with(filename, content).warnings))


TABLES = {
    CameraConfig: ("camera", "camera_plugin"),
    PingerConfig: ("pinger",),
    BallShooterConfig: ("shooter",),
    P3dConfig: ("noise",),
    ErrorModel: ("hector",),
    ThrusterConfig: ("thruster", "newer_thruster"),
    HydrodynamicsConfig: ("hydrodynamics", "water"),
    HullConfig: ("hull",),
}
"""Tables whose tags fill fields as they are."""


@pytest.mark.parametrize("model", TABLES, ids=lambda model: model.__name__)
def test_every_row_fills_a_field_and_its_default_is_within_its_limits(model):
    for field, tag in (row for table in TABLES[model] for row in FIELDS[table].items()):
        assert field in model.model_fields
        if isinstance(tag.default, int | float):
            assert tag.above < tag.default
            assert tag.low <= tag.default <= tag.high


@pytest.mark.parametrize("name", gazebo_sensors.INSTRUMENTS)
def test_a_plugin_of_which_only_the_link_is_known_is_a_sensor(name):
    (found,) = gazebo(plugin(f"lib{name}.so", "<bodyName>base_link</bodyName>")).sensors
    assert (found.type, found.link) == (gazebo_sensors.INSTRUMENTS[name].type, "base_link")


@pytest.mark.parametrize("name", gazebo_sensors.SENSORS)
def test_a_sensor_of_which_nothing_is_said_is_gazebos(name):
    inside = "<camera/><ray><scan><horizontal/></scan></ray>"
    (found,) = gazebo(sensor(name, inside), "eye_link").sensors
    assert (found.type, found.link, found.name) == (gazebo_sensors.SENSORS[name].type, "eye_link", "eye")


def test_a_sensors_own_topic_counts_where_its_plugin_names_none():
    content = '<topic>seen</topic><camera/><plugin name="p" filename="libgazebo_ros_camera.so"/>'
    (found,) = gazebo(sensor("camera", content), "eye_link").sensors
    assert found.topic == "seen"


@pytest.mark.parametrize("kind", ["camera", "rgbd_camera", "boundingbox_camera", "segmentation_camera"])
def test_cameras_that_say_what_they_see_have_labels(kind):
    read = gazebo(sensor(kind, "<update_rate>9</update_rate><camera><box_type>2d</box_type></camera>"), "eye_link")
    assert read.warnings == []
    assert read.sensors[0].labels == (kind in ("boundingbox_camera", "segmentation_camera"))
