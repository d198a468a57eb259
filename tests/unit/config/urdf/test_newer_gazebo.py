"""Gazebo's tags as VRX 3 writes them: sensors, thrusters, drag and hulls."""

import math

import pytest

from unit.config.urdf.test_gazebo import gazebo

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
  <dynamic_bias_stddev>0.00002</dynamic_bias_stddev>
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
    assert rates.drift[0] == pytest.approx(2e-5 * math.sqrt(200))  # stationary deviation, by hand
    assert rates.drift_frequency[0] == pytest.approx(1 / 400)
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
    assert newer.warnings == (
        (
            "boat.urdf:4: gazebo / plugin 'gz::sim::systems::Thruster': commands are newtons only in worlds of "
            "profile vrx3, else shares of the largest thrust, -1 to 1"
        ),
    )


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
    assert found.warnings == (
        (
            "boat.urdf:3: gazebo / plugin 'vrx::Surface': the fluid_level and fluid_density of this hull apply to all "
            "hulls"
        ),
    )


def test_a_newer_hull_without_points_carries_nothing():
    found = gazebo(SURFACE.format("<points><point>0.94 0</point></points>") + DRAG)
    assert found.hydrodynamics is None
    assert found.warnings == (
        (
            "boat.urdf:3: gazebo / plugin 'vrx::Surface': expected three numbers in each of its <points>; this hull "
            "has no buoyancy"
        ),
        (
            "boat.urdf:3: gazebo / plugin 'vrx::SimpleHydrodynamics': no hull (Surface plugin) with points belongs to "
            "it; it has no buoyancy"
        ),
    )
