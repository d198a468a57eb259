"""Broken and hostile files of Gazebo and ROS, with the whole message of each; none is run, nor read outside."""

import os
import time
from pathlib import Path

import pytest

from vrx_mj.config.gazebo.importing import import_files
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
SECONDS = 5.0
"""Time of the processor [s] that the worst file may take; they take 1 s."""
SCORING = (
    '<plugin filename="libwayfinding_scoring_plugin.so" name="a"><waypoints><waypoint><po'
    "se>-33.7 150.6 0</pose></waypoint></waypoints></plugin>"
)
MESSAGE = (
    '<plugin filename="libPublisherPlugin.so" name="p"><message topic="/vrx/wavefield/parameters">%s</message></plugin>'
)
LINK = (
    '<link name="link"><inertial><mass>5</mass></inertial><collision name="c"><geometry><'
    "sphere><radius>0.3</radius></sphere></geometry></collision></link>"
)
NODE = '<node pkg="gazebo_ros" type="spawn_model" name="spawn" args="%s"/>'
PARAM = (
    '<param name="robot_description" command="$(find xacro)/xacro $(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>\n'
)
XML = '<?xml version="1.0"?>\n'
BOMB = (
    '<!DOCTYPE sdf [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9))
    + "]>\n"
)
WORLD = '<sdf version="1.6"><world name="bay">%s</world></sdf>'
ERB = "<sdf><model name='dock'>\n<%%\nlayout = %s\n%%>\n</model></sdf>"


def mod(body, name="buoy"):
    """The file of a model."""
    return f'<sdf version="1.6">\n<model name="{name}">\n{body}\n</model>\n</sdf>\n'


WORLDS = {
    "pose_of_nan": (
        "<include><uri>model://surmark46104</uri><pose>nan 0 0 0 0 0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got 'nan 0 0 0 0 0'",
    ),
    "pose_of_infinity": (
        "<include><uri>model://surmark46104</uri><pose>0 inf 0 0 0 0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '0 inf 0 0 0 0'",
    ),
    "pose_beyond_floats": (
        "<include><uri>model://surmark46104</uri><pose>0 1e400 0 0 0 0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '0 1e400 0 0 0 0'",
    ),
    "pose_too_large": (
        "<include><uri>model://surmark46104</uri><pose>0 1e13 0 0 0 0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '0 1e13 0 0 0 0'",
    ),
    "pose_far_away": (
        "<include><uri>model://surmark46104</uri><pose>0 1e11 0 0 0 0</pose></include>",
        "bay.world:3:41: objects[0].pose[1]: must be at most 1e+09 in size, got 100000000000",
    ),
    "pose_of_five_numbers": (
        "<include><uri>model://surmark46104</uri><pose>1 2 3 4 5</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 2 3 4 5'",
    ),
    "pose_of_seven_numbers": (
        "<include><uri>model://surmark46104</uri><pose>1 2 3 4 5 6 7</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 2 3 4 5 6 7'",
    ),
    "pose_of_words": (
        "<include><uri>model://surmark46104</uri><pose>here and there</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got 'here and there'",
    ),
    "pose_with_commas": (
        "<include><uri>model://surmark46104</uri><pose>1,2,3,0,0,0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1,2,3,0,0,0'",
    ),
    "pose_with_underscores": (
        "<include><uri>model://surmark46104</uri><pose>1_0 2 3 0 0 0</pose></include>",
        "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1_0 2 3 0 0 0'",
    ),
    "pose_of_a_long_text": (
        "<include><uri>model://surmark46104</uri><pose>" + "1 " * 3000 + "</pose></include>",
        (
            "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 1 1 1 1 1 1 1 1 1 1 1 1 "
            "1 1 1 1 1 1 1… 1 1 1 1 1 1 1 1 1 1'"
        ),
    ),
    "pose_relative_to_another": (
        ('<include><uri>model://surmark46104</uri><pose relative_to="dock">1 2 3 0 0 0</pose></include>'),
        ("bay.world:3:41: <pose>: a pose relative to 'dock' cannot be taken over: give it in the frame of the model"),
    ),
    "pose_beneath_an_undeclared_frame": (
        ('<include><uri>model://surmark46104</uri><pose frame="boat">1 2 3 0 0 0</pose></include>'),
        ("bay.world:3:41: <pose>: a pose relative to 'boat' cannot be taken over: give it in the frame of the model"),
    ),
    "uri_missing": (
        "<include><pose>1 2 3 0 0 0</pose></include>",
        "bay.world:3:1: <include>: <uri> is required, but missing",
    ),
    "uri_empty": ("<include><uri/></include>", "bay.world:3:1: <include>: <uri> is required, but missing"),
    "uri_of_a_file": (
        "<include><uri>file:///etc/passwd</uri></include>",
        (
            "bay.world:3:1: <include> 'file:///etc/passwd' / uri: expected the name of a model, as model://NA"
            "ME, got 'file:///etc/passwd'"
        ),
    ),
    "uri_of_a_file_in_capitals": (
        "<include><uri>FILE:///etc/passwd</uri></include>",
        (
            "bay.world:3:1: <include> 'FILE:///etc/passwd' / uri: expected the name of a model, as model://NA"
            "ME, got 'FILE:///etc/passwd'"
        ),
    ),
    "uri_absolute": (
        "<include><uri>/etc/passwd</uri></include>",
        (
            "bay.world:3:1: <include> '/etc/passwd' / uri: expected the name of a model, as model://NAME, got"
            " '/etc/passwd'"
        ),
    ),
    "uri_upwards": (
        "<include><uri>model://../../secret</uri></include>",
        (
            "bay.world:3:1: <include> 'model://../../secret' / uri: expected the name of a model, as model://"
            "NAME, got 'model://../../secret'"
        ),
    ),
    "uri_upwards_in_the_middle": (
        "<include><uri>model://buoy/../../secret</uri></include>",
        (
            "bay.world:3:1: <include> 'model://buoy/../../secret' / uri: expected the name of a model, as mod"
            "el://NAME, got 'model://buoy/../../secret'"
        ),
    ),
    "uri_without_a_name": (
        "<include><uri>model://</uri></include>",
        ("bay.world:3:1: <include> 'model://' / uri: expected the name of a model, as model://NAME, got 'model://'"),
    ),
    "gain_negative": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><gain>-1</gain'
            "></wave></plugin></model>"
        ),
        "bay.world:3:19: sea.gain: must be at least 0, got -1",
    ),
    "gain_of_words": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><gain>much</ga'
            "in></wave></plugin></model>"
        ),
        "bay.world:3:71: <gain>: expected a number, got 'much'",
    ),
    "period_zero": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><period>0</per'
            "iod></wave></plugin></model>"
        ),
        "bay.world:3:19: sea.period: must be above 0, got 0",
    ),
    "a_million_waves": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><number>100000'
            "0</number></wave></plugin></model>"
        ),
        "bay.world:3:19: sea.number: must be at most 100, got 1000000",
    ),
    "wave_model_unknown": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><model>JONSWAP'
            "</model></wave></plugin></model>"
        ),
        "bay.world:3:19: sea.model: expected pms, cwr or none, got 'jonswap'",
    ),
    "wave_direction_of_three": (
        (
            '<model name="sea"><plugin filename="libWavefieldModelPlugin.so"><wave><direction>1 0'
            " 0</direction></wave></plugin></model>"
        ),
        "bay.world:3:71: <direction>: expected 2 numbers x y, got '1 0 0'",
    ),
    "message_with_half_a_number": (
        MESSAGE % 'params { key: "gain" value { type: DOUBLE double_value: e.e } }',
        "bay.world:3:51: <message> / gain: expected a number, got 'e.e'",
    ),
    "message_beyond_floats": (
        MESSAGE % 'params { key: "gain" value { type: DOUBLE double_value: 1e400 } }',
        "bay.world:3:51: <message> / gain: expected a number, got '1e400'",
    ),
    "message_with_waves_beyond_floats": (
        MESSAGE % 'params { key: "number" value { type: INT32 int_value: 1e400 } }',
        "bay.world:3:51: <message> / number: expected a number, got '1e400'",
    ),
    "message_with_a_word_for_a_direction": (
        MESSAGE % 'params { key: "direction" value { type: STRING string_value: "east" } }',
        "bay.world:3:51: <message> / direction: expected a number, got 'east'",
    ),
    "message_too_long": (
        MESSAGE % ('params { key: "a" value {' + "x" * 100000),
        "bay.world:3:51: <message>: a message of more than 20000 characters is too long",
    ),
    "wind_object_without_name": (
        (
            '<plugin filename="libusv_gazebo_wind_plugin.so"><wind_obj><coeff_vector>1 1 1</coeff'
            "_vector></wind_obj></plugin>"
        ),
        "bay.world:3:49: <wind_obj>: <name> is required, but missing",
    ),
    "wind_object_without_coefficients": (
        ('<plugin filename="libusv_gazebo_wind_plugin.so"><wind_obj><name>wamv</name></wind_obj></plugin>'),
        "bay.world:3:49: <wind_obj> 'wamv': <coeff_vector> is required, but missing",
    ),
    "wind_of_two_directions": (
        ('<plugin filename="libusv_gazebo_wind_plugin.so"><wind_direction>1 2</wind_direction></plugin>'),
        "bay.world:3:49: <wind_direction>: expected a number, got '1 2'",
    ),
    "wind_with_time_zero": (
        (
            '<plugin filename="libusv_gazebo_wind_plugin.so"><var_wind_time_constants>0</var_wind'
            "_time_constants><var_wind_gain_constants>1</var_wind_gain_constants></plugin>"
        ),
        "bay.world:3:1: wind.var_time: must be above 0, got 0",
    ),
    "wind_with_a_negative_seed": (
        '<plugin filename="libusv_gazebo_wind_plugin.so"><random_seed>-5</random_seed></plugin>',
        "bay.world:3:1: wind.seed: must be at least 0, got -5",
    ),
    "color_of_two_numbers": (
        "<scene><ambient>1 1</ambient></scene>",
        "bay.world:3:8: <ambient>: expected 4 numbers r g b a, got '1 1'",
    ),
    "color_too_bright": (
        "<scene><ambient>2 2 2</ambient></scene>",
        (
            "bay.world:3:1: scene.ambient[0]: must be at most 1, got 2\n"
            "bay.world:3:1: scene.ambient[1]: must be at most 1, got 2\n"
            "bay.world:3:1: scene.ambient[2]: must be at most 1, got 2"
        ),
    ),
    "grid_of_words": (
        "<scene><grid>perhaps</grid></scene>",
        "bay.world:3:1: <scene> / grid: expected true or false, got 'perhaps'",
    ),
    "fog_of_an_unknown_type": (
        "<scene><fog><type>thick</type></fog></scene>",
        "bay.world:3:1: scene.fog.type: expected none, linear, exp or quadratic, got 'thick'",
    ),
    "fog_with_a_negative_density": (
        "<scene><fog><density>-1</density></fog></scene>",
        "bay.world:3:1: scene.fog.density: must be at least 0, got -1",
    ),
    "latitude_missing": (
        "<spherical_coordinates><longitude_deg>1</longitude_deg></spherical_coordinates>",
        "bay.world:3:1: <spherical_coordinates>: <latitude_deg> and <longitude_deg> are required",
    ),
    "latitude_beyond_the_pole": (
        (
            "<spherical_coordinates><latitude_deg>91</latitude_deg><longitude_deg>1</longitude_de"
            "g></spherical_coordinates>"
        ),
        "bay.world:3:1: georeference.latitude: must be at most 90, got 91",
    ),
    "gravity_upwards": (
        "<gravity>0 0 9.8</gravity>",
        "bay.world:3:1: <gravity>: gravity must point down, got '0 0 9.8'",
    ),
    "gravity_sideways": (
        "<gravity>1 0 -9.8</gravity>",
        "bay.world:3:1: <gravity>: gravity must point down, got '1 0 -9.8'",
    ),
    "gravity_of_one_number": (
        "<gravity>-9.8</gravity>",
        "bay.world:3:1: <gravity>: expected 3 numbers x y z, got '-9.8'",
    ),
    "gravity_of_a_star": (
        "<gravity>0 0 -1e11</gravity>",
        "bay.world:3:1: physics.gravity: must be at most 1e+09 in size, got 100000000000",
    ),
    "view_of_three_numbers": (
        "<gui><camera><pose>1 2 3</pose></camera></gui>",
        "bay.world:3:14: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 2 3'",
    ),
    "step_of_words": (
        "<physics><max_step_size>small</max_step_size></physics>",
        "bay.world:3:10: <max_step_size>: expected a number, got 'small'",
    ),
    "two_terrains": (
        ("<include><uri>model://sydney_regatta</uri></include>\n<include><uri>model://sandisland</uri></include>"),
        ("bay.world:4:1: <include> 'model://sandisland': a world has one terrain, which line 3 already gives"),
    ),
    "waypoints_missing": (
        '<plugin filename="libwayfinding_scoring_plugin.so" name="a"/>',
        "bay.world:3:1: <plugin> 'a' / waypoints: each <waypoint> of <waypoints> needs a <pose>",
    ),
    "waypoint_without_pose": (
        ('<plugin filename="libwayfinding_scoring_plugin.so"><waypoints><waypoint/></waypoints></plugin>'),
        "bay.world:3:1: <plugin> / waypoints: each <waypoint> of <waypoints> needs a <pose>",
    ),
    "waypoint_of_two_numbers": (
        (
            '<plugin filename="libwayfinding_scoring_plugin.so"><waypoints><waypoint><pose>1 2</p'
            "ose></waypoint></waypoints></plugin>"
        ),
        "bay.world:3:73: <pose>: expected 3 numbers latitude longitude yaw, got '1 2'",
    ),
    "goal_empty": (
        '<plugin filename="libstationkeeping_scoring_plugin.so"><goal_pose/></plugin>',
        "bay.world:3:56: <goal_pose>: expected 3 numbers latitude longitude yaw, got ''",
    ),
    "goal_missing": (
        '<plugin filename="libstationkeeping_scoring_plugin.so"/>',
        "bay.world:3:1: task.goal: required for a stationkeeping task, unless goal_cart is given",
    ),
    "goal_beyond_the_pole": (
        ('<plugin filename="libstationkeeping_scoring_plugin.so"><goal_pose>100 0 0</goal_pose></plugin>'),
        "bay.world:3:1: task.goal[0]: must be at most 90, got 100",
    ),
    "duration_negative": (
        SCORING.replace("<waypoints>", "<running_state_duration>-1</running_state_duration><waypoints>"),
        "bay.world:3:1: task.running_state_duration: must be at least 0, got -1",
    ),
    "duration_of_nan": (
        SCORING.replace("<waypoints>", "<running_state_duration>nan</running_state_duration><waypoints>"),
        "bay.world:3:61: <running_state_duration>: expected a number, got 'nan'",
    ),
    "perceived_without_name": (
        (
            '<plugin filename="libperception_scoring_plugin.so"><object_sequence><object><pose>0 '
            "0 0 0 0 0</pose></object></object_sequence></plugin>"
        ),
        "bay.world:3:69: <object>: <name> and <pose> are required",
    ),
    "dock_missing": (
        '<plugin filename="libscan_dock_scoring_plugin.so"><task_name>dock</task_name></plugin>',
        "bay.world:3:1: <plugin>: no dock is among the models of the world, which this task needs",
    ),
    "hole_unknown": (
        (
            '<include><uri>dock_2022</uri></include>\n<plugin filename="libscan_dock_scoring_plugi'
            'n.so"><targets><target><topic>hole</topic></target></targets></plugin>'
        ),
        ("bay.world:4:60: <target> / topic: expected the topic of a hole, as vrx/dock_2022_placard1_big_hole/contain"),
    ),
    "hole_of_a_long_name": (
        (
            '<include><uri>dock_2022</uri></include>\n<plugin filename="libscan_dock_scoring_plugi'
            'n.so"><targets><target><topic>'
        )
        + "placard1" * 100000
        + "</topic></target></targets></plugin>",
        ("bay.world:4:60: <target> / topic: expected the topic of a hole, as vrx/dock_2022_placard1_big_hole/contain"),
    ),
    "gymkhana_without_channel": (
        ('<plugin filename="libgymkhana_scoring_plugin.so"><pinger_position>1 2 3</pinger_position></plugin>'),
        "bay.world:3:1: <plugin>: a gymkhana needs a navigation scoring plugin and a <pinger_position>",
    ),
    "beacon_missing": (
        '<plugin filename="libacoustic_perception_scoring_plugin.so"/>',
        "bay.world:3:1: <plugin>: <pinger_position> is required",
    ),
    "beacon_of_two_numbers": (
        ('<plugin filename="libacoustic_perception_scoring_plugin.so"><pinger_position>1 2</pinger_position></plugin>'),
        "bay.world:3:61: <pinger_position>: expected 3 numbers x y z, got '1 2'",
    ),
    "two_objects_of_one_name": (
        (
            "<include><name>buoy</name><uri>surmark46104</uri></include>\n<include><name>buoy</nam"
            "e><uri>surmark950400</uri><pose>5 0 0 0 0 0</pose></include>"
        ),
        "bay.world:4:1: objects[1].name: duplicate name 'buoy'",
    ),
    "path_without_points": (
        '<include><uri>surmark46104</uri><plugin filename="libfollow_plugin.so"/></include>',
        "bay.world:3:1: objects[0].path.waypoints: a path needs `waypoints`, a `circle` or a `line`",
    ),
    "path_of_one_number": (
        (
            '<include><uri>surmark46104</uri><plugin filename="libfollow_plugin.so"><waypoints><w'
            "aypoint>5</waypoint></waypoints></plugin></include>"
        ),
        "bay.world:3:83: <waypoint>: expected 2 numbers x y, got '5'",
    ),
    "path_of_a_dock": (
        (
            '<include><uri>dock_2022</uri><plugin filename="libfollow_plugin.so"><circle><radius>'
            "5</radius></circle></plugin></include>"
        ),
        "bay.world:3:1: objects[0].path: 'dock_2022' does not float, so it cannot follow a path",
    ),
    "model_without_a_name": ("<model>" + LINK + "</model>", "bay.world:3:1: <model> / name: required, but missing"),
    "model_without_links": (
        '<model name="buoy"/>',
        "bay.world:3:1: <model> 'buoy': a model without links or includes is nothing",
    ),
    "mass_negative": (
        ('<model name="buoy"><link name="link"><inertial><mass>-1</mass></inertial></link></model>'),
        "bay.world:3:38: <inertial> / mass: must be above 0, got -1",
    ),
    "mass_zero": (
        ('<model name="buoy"><link name="link"><inertial><mass>0</mass></inertial></link></model>'),
        "bay.world:3:38: <inertial> / mass: must be above 0, got 0",
    ),
    "masses_that_cancel": (
        (
            '<model name="buoy"><link name="a"><inertial><mass>1</mass></inertial></link><link na'
            'me="b"><inertial><mass>-1</mass></inertial></link></model>'
        ),
        "bay.world:3:92: <inertial> / mass: must be above 0, got -1",
    ),
    "mass_of_nan": (
        ('<model name="buoy"><link name="link"><inertial><mass>nan</mass></inertial></link></model>'),
        "bay.world:3:48: <mass>: expected a number, got 'nan'",
    ),
    "inertia_zero": (
        (
            '<model name="buoy"><link name="link"><inertial><mass>1</mass><inertia><ixx>0</ixx><i'
            'yy>0</iyy><izz>0</izz></inertia></inertial><collision name="c"><geometry><sphere><ra'
            "dius>1</radius></sphere></geometry></collision></link></model>"
        ),
        (
            "bay.world:3:1: inertia[0]: must be above 0, got 0\n"
            "bay.world:3:1: inertia[1]: must be above 0, got 0\n"
            "bay.world:3:1: inertia[2]: must be above 0, got 0"
        ),
    ),
    "inertia_impossible": (
        (
            '<model name="buoy"><link name="link"><inertial><mass>1</mass><inertia><ixx>9</ixx><i'
            'yy>1</iyy><izz>1</izz></inertia></inertial><collision name="c"><geometry><sphere><ra'
            "dius>1</radius></sphere></geometry></collision></link></model>"
        ),
        "bay.world:3:1: inertia: impossible moments of inertia: 9 is more than the sum of the other two",
    ),
    "radius_negative": (
        (
            '<model name="buoy"><static>true</static><link name="link"><collision name="c"><geome'
            "try><sphere><radius>-1</radius></sphere></geometry></collision></link></model>"
        ),
        "bay.world:3:1: collisions[0].radius: must be above 0, got -1",
    ),
    "size_zero": (
        (
            '<model name="wall"><static>true</static><link name="link"><collision name="c"><geome'
            "try><box><size>0 1 1</size></box></geometry></collision></link></model>"
        ),
        "bay.world:3:1: collisions[0].size[0]: must be above 0, got 0",
    ),
    "size_of_two_numbers": (
        (
            '<model name="wall"><static>true</static><link name="link"><collision name="c"><geome'
            "try><box><size>1 1</size></box></geometry></collision></link></model>"
        ),
        "bay.world:3:94: <size>: expected 3 numbers x y z, got '1 1'",
    ),
    "buoyancy_of_no_link": (
        '<model name="buoy">'
        + LINK
        + (
            '<plugin filename="libbuoyancy_gazebo_plugin.so"><buoyancy><link_name>keel</link_name'
            "></buoyancy></plugin></model>"
        ),
        "bay.world:3:218: <buoyancy> / link_name: no link named 'keel'; known: link",
    ),
    "link_pose_of_two_numbers": (
        '<model name="buoy"><link name="link"><pose>1 2</pose></link></model>',
        "bay.world:3:38: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 2'",
    ),
    "color_of_a_model": (
        (
            '<model name="wall"><static>true</static><link name="link"><visual name="v"><geometry'
            "><box/></geometry><material><diffuse>a b c</diffuse></material></visual></link></mod"
            "el>"
        ),
        "bay.world:3:113: <diffuse>: expected 3 numbers r g b, got 'a b c'",
    ),
    "unbound_prefix": (
        "<ros:topic/>",
        (
            "bay.world:3:1: the prefix of a name here, as in 'xacro:if', is not declared; the outermost eleme"
            "nt needs xmlns:xacro"
        ),
    ),
    "tag_never_closed": ("<include>", "bay.world:4:3: expected </include>, which ends the <include> of line 3"),
    "entity_undeclared": (
        "<include><uri>&secret;</uri></include>",
        "bay.world:3:15: no such &name; here; XML knows &lt; &gt; &amp; &quot; and &apos;",
    ),
    "attribute_twice": ('<include a="1" a="2"/>', "bay.world:3:16: an attribute is given twice"),
    "stray_sign": (
        "<include><uri>a & b</uri></include>",
        "bay.world:3:18: is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='",
    ),
    "nested_too_deep": ("<a>" * 70 + "</a>" * 70, "bay.world:3:175: <a>: elements are nested deeper than 60 levels"),
    "too_many_elements": (
        "<a/>" * 900000,
        "bay.world:3:199985: <a>: more than 50000 elements and attributes in a file",
    ),
    "too_many_models": (
        "".join(f'<model name="m{i}">{LINK}</model>' for i in range(1000)) + "<gravity>0</gravity>",
        "bay.world:3:176891: <gravity>: expected 3 numbers x y z, got '0'",
    ),
    "too_many_unknown_models": (
        "".join(f"<include><uri>m{i}</uri></include>" for i in range(1000)) + "<gravity>0</gravity>",
        "bay.world:3:33891: <gravity>: expected 3 numbers x y z, got '0'",
    ),
    "name_of_a_million_letters": (
        "<include><name>" + "x" * 1000000 + "</name><uri>surmark46104</uri><pose>1</pose></include>",
        "bay.world:3:1000046: <pose>: expected 6 numbers x y z roll pitch yaw, got '1'",
    ),
    "attribute_of_a_million_letters": (
        '<model name="' + "x" * 1000000 + '"/>',
        (
            "bay.world:3:1: <model> 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxxxxxx': a model w"
            "ithout links or includes is nothing"
        ),
    ),
}
XACRO = {
    "macro_unknown": (
        "<xacro:sydneyregata/>",
        (
            "bay.world.xacro:3:1: <sydneyregata>: no macro named 'sydneyregata'; did you mean 'sydneyregatta'"
            "?; is its <xacro:include> missing?"
        ),
    ),
    "macro_of_ones_own_missing": (
        "<xacro:my_course/>",
        (
            "bay.world.xacro:3:1: <my_course>: no macro named 'my_course'; known: sandisland, sandisland_minu"
            "s_scene, sydneyregatta, sydneyregatta_minus_scene, marina, marina_minus_scene, ocean_waves, usv_"
            "wind_gazebo, scene_macro, insert_model, stationkeeping, wayfinding and 7 more; is its <xacro:inc"
            "lude> missing?"
        ),
    ),
    "parameter_unknown": (
        '<xacro:insert_model uri="dock_2018" n="5"/>',
        ("bay.world.xacro:3:1: <insert_model>.n: no parameter of insert_model named 'n'; known: uri, x, y, z, R, P, Y"),
    ),
    "parameter_of_words": (
        '<xacro:insert_model uri="dock_2018" x="here"/>',
        "bay.world.xacro:3:1: <insert_model>.x: expected a number, got 'here'",
    ),
    "parameter_of_nan": (
        '<xacro:insert_model uri="dock_2018" x="nan"/>',
        "bay.world.xacro:3:1: objects[0].pose[0]: must be finite, got nan",
    ),
    "block_missing": (
        "<xacro:wayfinding/>",
        "bay.world.xacro:3:1: <wayfinding>: wayfinding needs the parameter '/**waypoints'",
    ),
    "block_unknown": (
        "<xacro:wayfinding><points/></xacro:wayfinding>",
        (
            "bay.world.xacro:3:19: <wayfinding>./**points: no parameter of wayfinding named '/**points'; did "
            "you mean '/**waypoints'?"
        ),
    ),
    "model_unknown": (
        '<xacro:insert_model uri="galleon"/>',
        (
            "bay.world.xacro:3:1: objects[0].model: no object model named 'galleon'; known: antenna, black_to"
            "tem, blue_projectile, blue_totem, chair, crocodile_2023, crocodile_buoy, crocodile_static, demo_"
            "box, demo_cylinder, demo_joined, demo_sphere and 132 more"
        ),
    ),
    "two_bases": (
        "<xacro:sydneyregatta/>\n<xacro:sandisland/>",
        ("bay.world.xacro:4:1: <sandisland>: a world has one base, which 'sydneyregatta' on line 3 already gives"),
    ),
    "two_tasks": (
        (
            '<xacro:sydneyregatta/>\n<xacro:stationkeeping lat="-33.72" lon="150.67"/>\n<xacro:wayf'
            "inding><waypoints><waypoint><pose>-33.7 150.6 0</pose></waypoint></waypoints></xacro"
            ":wayfinding>"
        ),
        ("bay.world.xacro:5:1: <wayfinding>: a world has one task, which 'stationkeeping' on line 4 already gives"),
    ),
    "code_in_an_expression": (
        '<include><name>${__import__("os").system("touch owned")}</name></include>',
        (
            'bay.world.xacro:3:16: <name>: ${__import__("os").system("touch owned")}: names that begin with \''
            "__' are not allowed: __import__"
        ),
    ),
    "attributes_of_classes": (
        "<include><name>${().__class__.__bases__[0].__subclasses__()}</name></include>",
        (
            "bay.world.xacro:3:16: <name>: ${().__class__.__bases__[0].__subclasses__()}: names that begin wi"
            "th '__' are not allowed: __class__"
        ),
    ),
    "file_opened_in_an_expression": (
        '<include><name>${open("/etc/passwd").read()}</name></include>',
        (
            "bay.world.xacro:3:16: <name>: ${open(\"/etc/passwd\").read()}: no function named 'open'; known: ab"
            "s, acos, acosh, all, any, asin, asinh, atan, atan2, atanh, bool, cbrt and 68 more"
        ),
    ),
    "package_upwards": (
        '<xacro:include filename="$(find ../..)/etc/passwd"/>',
        (
            "bay.world.xacro:3:26: <xacro:include>: $(find ../..): no package named '../..'; known: vrx_gazeb"
            "o, wamv, wamv_description, wamv_gazebo (or add its folder to the package paths)"
        ),
    ),
    "package_unknown": (
        '<xacro:include filename="$(find my_worlds)/a.xacro"/>',
        (
            "bay.world.xacro:3:26: <xacro:include>: $(find my_worlds): no package named 'my_worlds'; known: v"
            "rx_gazebo, wamv, wamv_description, wamv_gazebo (or add its folder to the package paths)"
        ),
    ),
    "include_of_an_absolute_path": (
        '<xacro:include filename="/etc/passwd"/>',
        (
            "bay.world.xacro:3:1: <xacro:include>: may not read '/etc/passwd': it is neither in the folder of"
            " the first file nor in a package; add its folder to the package paths"
        ),
    ),
    "include_upwards": (
        '<xacro:include filename="../../../../../../etc/passwd"/>',
        (
            "bay.world.xacro:3:1: <xacro:include>: may not read '../../../../../../etc/passwd': it is neither"
            " in the folder of the first file nor in a package; add its folder to the package paths"
        ),
    ),
    "include_of_itself": (
        '<xacro:include filename="bay.world.xacro"/>',
        ("bay.world.xacro:3:1: <xacro:include>: files include each other: bay.world.xacro > bay.world.xacro"),
    ),
    "include_missing": (
        '<xacro:include filename="buoys.xacro"/>',
        "bay.world.xacro:3:1: <xacro:include>: no file 'buoys.xacro' in the current folder",
    ),
    "environment": (
        "<include><name>$(env HOME)</name></include>",
        (
            "bay.world.xacro:3:16: <name>: $(env HOME): files cannot see environment variable 'HOME'; declare"
            " an argument and use $(arg HOME)"
        ),
    ),
    "argument_undeclared": (
        "<include><name>$(arg buoy)</name></include>",
        (
            "bay.world.xacro:3:16: <name>: $(arg buoy): no argument named 'buoy'; known: none; or give it in "
            "the YAML beside the file: `arguments: {buoy: ...}`"
        ),
    ),
    "macro_that_calls_itself": (
        '<xacro:macro name="again"><xacro:again/></xacro:macro>\n<xacro:again/>',
        (
            "bay.world.xacro:3:27: <xacro:again>: macros call each other deeper than 60 levels: again > again"
            " (in macro 'again' called at bay.world.xacro:3, in macro 'again' called at bay.world.xacro:4)"
        ),
    ),
    "macros_that_double": (
        "\n".join(f'<xacro:macro name="a{i}"><xacro:a{i + 1}/><xacro:a{i + 1}/></xacro:macro>' for i in range(40))
        + '\n<xacro:macro name="a40"><include/></xacro:macro>\n<xacro:a0/>',
        (
            "bay.world.xacro:41:25: <xacro:a39>: takes too much work to expand; is there a loop, or a macro t"
            "hat repeats itself? (in macro 'a38' called at bay.world.xacro:40, in macro 'a37' called at bay.w"
            "orld.xacro:39, in macro 'a36' called at bay.world.xacro:38)"
        ),
    ),
    "power_tower": (
        "<include><name>${9**9**9**9}</name></include>",
        "bay.world.xacro:3:16: <name>: ${9**9**9**9}: 9 to the power 387420489 is too large",
    ),
}
LAUNCHES = {
    "eval_of_code": (
        """<arg name="a" value="$(eval __import__('os').system('touch owned'))"/>""",
        (
            "bay.launch:2:1: <arg> 'a': '$(eval __import__('os').system('touch owned'))': names that begin wi"
            "th '__' are not allowed: __import__"
        ),
    ),
    "eval_of_a_file": (
        """<arg name="a" value="$(eval open('/etc/passwd').read())"/>""",
        (
            "bay.launch:2:1: <arg> 'a': '$(eval open('/etc/passwd').read())': no function named 'open'; known"
            ": abs, acos, acosh, all, any, asin, asinh, atan, atan2, atanh, bool, cbrt and 68 more"
        ),
    ),
    "eval_inside_of_a_text": (
        '<arg name="a" value="x$(eval 1)y"/>',
        (
            "bay.launch:2:1: <arg> 'a': 'x$(eval 1)y': $(eval ...) must be the whole value, as in roslaunch; "
            "give it an <arg> of its own"
        ),
    ),
    "eval_that_never_ends": (
        '<arg name="a" value="$(eval [x for x in range(10**9)])"/>',
        (
            "bay.launch:2:1: <arg> 'a': '$(eval [x for x in range(10**9)])': a list or mapping of more than 2"
            "0000 values is too large"
        ),
    ),
    "find_upwards": (
        '<arg name="a" value="$(find ../..)/etc/passwd"/>',
        (
            "bay.launch:2:1: <arg> 'a': '$(find ../..)/etc/passwd': no package named '../..'; known: none (or"
            " add its folder to the package paths)"
        ),
    ),
    "find_unknown": (
        '<arg name="a" value="$(find my_boats)/worlds/bay.world"/>',
        (
            "bay.launch:2:1: <arg> 'a': '$(find my_boats)/worlds/bay.world': no package named 'my_boats'; kno"
            "wn: none (or add its folder to the package paths)"
        ),
    ),
    "substitution_unknown": (
        '<arg name="a" value="$(shell ls)"/>',
        (
            "bay.launch:2:1: <arg> 'a': '$(shell ls)': no substitution named 'shell'; known: find, arg, dirna"
            "me, cwd, env, optenv, anon, eval"
        ),
    ),
    "substitution_open": (
        '<arg name="a" value="$(arg b"/>',
        "bay.launch:2:1: <arg> 'a': '$(arg b': '$(' is never closed",
    ),
    "substitution_in_another": (
        '<arg name="a" default="b"/><arg name="b" value="$(arg $(arg a))"/>',
        "bay.launch:2:28: <arg> 'b': '$(arg $(arg a))': takes one name, $(arg NAME), got 2",
    ),
    "environment_of_a_launch_file": (
        '<arg name="a" value="$(env HOME)"/>',
        (
            "bay.launch:2:1: <arg> 'a': '$(env HOME)': files cannot see environment variable 'HOME'; declare "
            "an argument and use $(arg HOME)"
        ),
    ),
    "argument_used_before": (
        '<arg name="b" value="$(arg a)"/><arg name="a" default="5"/>',
        ("bay.launch:2:1: <arg> 'b': '$(arg a)': no argument named 'a'; known: b; declare it before in an <arg>"),
    ),
    "argument_without_value": ('<arg name="a"/>', "bay.launch:2:1: <arg> 'a': has no value: add a:=VALUE"),
    "argument_without_name": ('<arg default="5"/>', "bay.launch:2:1: <arg> / name: required, but missing"),
    "arguments_that_double": (
        '<arg name="a0" value="'
        + "x" * 100
        + '"/>'
        + "".join(f'<arg name="a{i + 1}" value="$(arg a{i})$(arg a{i})"/>' for i in range(60)),
        ("bay.launch:2:427: <arg> 'a8': '$(arg a7)$(arg a7)': a text of more than 20000 characters is too long"),
    ),
    "condition_of_words": (
        '<group if="perhaps"/>',
        "bay.launch:2:1: <group> / if: expected true or false, got 'perhaps'",
    ),
    "condition_empty": ('<group unless=""/>', "bay.launch:2:1: <group> / unless: expected true or false, got ''"),
    "command_of_a_shell": (
        '<param name="robot_description" command="bash -c \'touch owned\'"/>',
        (
            "bay.launch:2:1: <param> 'robot_description' / command: expected a command of xacro, got 'bash -c"
            " 'touch owned''; others are not run"
        ),
    ),
    "command_after_xacro": (
        '<param name="robot_description" command="xacro a.xacro; touch owned"/>',
        "bay.launch:2:1: <param> 'robot_description': no file 'a.xacro;' in the current folder",
    ),
    "command_in_backquotes": (
        '<param name="robot_description" command="`touch owned`"/>',
        (
            "bay.launch:2:1: <param> 'robot_description' / command: expected a command of xacro, got '`touch "
            "owned`'; others are not run"
        ),
    ),
    "command_cat_of_a_secret": (
        '<param name="robot_description" command="cat /etc/passwd"/>',
        (
            "bay.launch:2:1: <param> 'robot_description': may not read '/etc/passwd': it is neither in the fo"
            "lder of the first file nor in a package; add its folder to the package paths"
        ),
    ),
    "command_of_xacro_alone": (
        '<param name="robot_description" command="xacro"/>',
        (
            "bay.launch:2:1: <param> 'robot_description' / command: expected a command of xacro, got 'xacro';"
            " others are not run"
        ),
    ),
    "command_with_an_open_quote": (
        '<param name="robot_description" command="xacro \'a.xacro"/>',
        "bay.launch:2:1: <param> 'robot_description' / command: 'xacro 'a.xacro': No closing quotation",
    ),
    "textfile_absolute": (
        '<param name="robot_description" textfile="/etc/passwd"/>',
        (
            "bay.launch:2:1: <param> 'robot_description': may not read '/etc/passwd': it is neither in the fo"
            "lder of the first file nor in a package; add its folder to the package paths"
        ),
    ),
    "textfile_upwards": (
        ('<param name="robot_description" textfile="$(dirname)/../../../../../../../etc/passwd"/>'),
        (
            "bay.launch:2:1: <param> 'robot_description': may not read '../../../../../../../etc/passwd': it "
            "is neither in the folder of the first file nor in a package; add its folder to the package paths"
        ),
    ),
    "textfile_missing": (
        '<param name="robot_description" textfile="$(dirname)/boat.urdf"/>',
        "bay.launch:2:1: <param> 'robot_description': no file 'boat.urdf' in the current folder",
    ),
    "parameter_without_name": (
        '<param command="xacro a.xacro"/>',
        "bay.launch:2:1: <param> / name: required, but missing",
    ),
    "description_in_a_missing_package": (
        '<param name="robot_description" textfile="$(find vrx_gazebo)/urdf/boat.urdf"/>',
        (
            "bay.launch:2:1: <param> 'robot_description': no package for vrx_gazebo/urdf/boat.urdf: add its f"
            "older to VRX_MJ_PACKAGE_PATH"
        ),
    ),
    "spawned_without_name": (
        PARAM + NODE % "-urdf -param robot_description",
        "bay.launch:3:1: <node> 'spawn' / args: a spawned model needs -model NAME",
    ),
    "spawned_without_description": (
        NODE % "-urdf -param robot_description -model wamv",
        ("bay.launch:2:1: <node> 'spawn' / args: -param: no parameter named '/robot_description'; known: none"),
    ),
    "spawned_with_a_wrong_parameter": (
        PARAM + NODE % "-urdf -param robot_descripton -model wamv",
        (
            "bay.launch:3:1: <node> 'spawn' / args: -param: no parameter named '/robot_descripton'; did you m"
            "ean '/robot_description'?"
        ),
    ),
    "spawned_with_a_missing_file": (
        NODE % "-urdf -file boat.urdf -model wamv",
        "bay.launch:2:1: <node> 'spawn': no file 'boat.urdf' in the current folder",
    ),
    "spawned_from_outside": (
        NODE % "-urdf -file /etc/passwd -model wamv",
        (
            "bay.launch:2:1: <node> 'spawn': may not read '/etc/passwd': it is neither in the folder of the f"
            "irst file nor in a package; add its folder to the package paths"
        ),
    ),
    "spawned_twice": (
        PARAM
        + NODE % "-urdf -param robot_description -model wamv -x 1"
        + "\n"
        + NODE % "-urdf -param robot_description -model wamv -x 9",
        (
            "bay.launch:4:1: <node> 'spawn' / args: a model named 'wamv' is spawned on line 3 already: each n"
            "eeds -model NAME of its own"
        ),
    ),
    "spawned_at_nan": (
        PARAM + NODE % "-urdf -param robot_description -model wamv -x nan",
        ("bay.launch:3:1: <node> 'spawn' / args: expected numbers for -x -y -z -R -P -Y, got 'nan 0 0 0 0 0'"),
    ),
    "spawned_at_infinity": (
        PARAM + NODE % "-urdf -param robot_description -model wamv -y -inf",
        ("bay.launch:3:1: <node> 'spawn' / args: expected numbers for -x -y -z -R -P -Y, got '0 -inf 0 0 0 0'"),
    ),
    "spawned_beyond_floats": (
        PARAM + NODE % "-urdf -param robot_description -model wamv -y 1e400",
        ("bay.launch:3:1: <node> 'spawn' / args: expected numbers for -x -y -z -R -P -Y, got '0 1e400 0 0 0 0'"),
    ),
    "spawned_at_words": (
        PARAM + NODE % "-urdf -param robot_description -model wamv -y north",
        ("bay.launch:3:1: <node> 'spawn' / args: expected numbers for -x -y -z -R -P -Y, got '0 north 0 0 0 0'"),
    ),
    "option_without_value": (
        PARAM + NODE % "-urdf -param robot_description -model wamv -x",
        "bay.launch:3:1: <node> 'spawn' / args: -x needs a value",
    ),
    "option_before_another": (
        PARAM + NODE % "-urdf -param robot_description -model -x 5",
        "bay.launch:3:1: <node> 'spawn' / args: -model needs a value",
    ),
    "options_with_an_open_quote": (
        PARAM + NODE % "-model 'wamv",
        "bay.launch:3:1: <node> 'spawn' / args: '-model 'wamv': No closing quotation",
    ),
    "include_without_file": ("<include/>", "bay.launch:2:1: <include> / file: required, but missing"),
    "include_of_a_missing_file": (
        '<include file="$(dirname)/other.launch"/>',
        "bay.launch:2:1: <include>: no file 'other.launch' in the current folder",
    ),
    "include_from_outside": (
        '<include file="/etc/passwd"/>',
        (
            "bay.launch:2:1: <include>: may not read '/etc/passwd': it is neither in the folder of the first "
            "file nor in a package; add its folder to the package paths"
        ),
    ),
    "include_of_a_launch_file_in_itself": (
        '<include file="$(dirname)/bay.launch"/>',
        "bay.launch: launch files include each other: bay.launch > bay.launch",
    ),
    "include_with_an_unknown_argument": (
        ('<include file="$(find vrx_gazebo)/launch/vrx.launch"><arg name="thrusters" value="H"/></include>'),
        (
            "bay.launch:2:1: <include>: no argument of vrx.launch named 'thrusters'; known: world, gui, verbo"
            "se, extra_gazebo_args, namespace, x, y, z, P, R, Y, thrust_config and 8 more"
        ),
    ),
    "world_missing": (
        (
            '<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" '
            'value="$(dirname)/sea.world"/></include>'
        ),
        "bay.launch:2:1: <include>: no file 'sea.world' in the current folder",
    ),
    "world_from_outside": (
        (
            '<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" '
            'value="/etc/passwd"/></include>'
        ),
        (
            "bay.launch:2:1: <include>: may not read '/etc/passwd': it is neither in the folder of the first "
            "file nor in a package; add its folder to the package paths"
        ),
    ),
    "world_of_the_root": (
        ('<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" value="/"/></include>'),
        (
            "bay.launch:2:1: <include>: may not read '/': it is neither in the folder of the first file nor i"
            "n a package; add its folder to the package paths"
        ),
    ),
    "world_of_a_long_name": (
        ('<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" value="')
        + "x" * 5000
        + '"/></include>',
        (
            "bay.launch:2:1: <include>: no file 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxx"
            "xxxxxxxxxxxxxxxxxxxx' in the current folder"
        ),
    ),
    "world_of_vrx_unknown": (
        (
            '<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" '
            'value="$(find vrx_gazebo)/worlds/gymkana.world"/></include>'
        ),
        (
            "bay.launch:2:1: <include>: no world of VRX named 'gymkana'; did you mean 'gymkhana'? (or add its"
            " package's folder to VRX_MJ_PACKAGE_PATH)"
        ),
    ),
    "world_of_a_stock_launch_from_outside": (
        ('<include file="$(find vrx_gazebo)/launch/vrx.launch"><arg name="world" value="/etc/passwd"/></include>'),
        (
            "bay.launch:2:1: <include>: may not read '/etc/passwd': it is neither in the folder of the first "
            "file nor in a package; add its folder to the package paths"
        ),
    ),
    "description_of_a_stock_launch_from_outside": (
        ('<include file="$(find vrx_gazebo)/launch/vrx.launch"><arg name="urdf" value="/etc/passwd"/></include>'),
        (
            "bay.launch:2:1: <include>: may not read '/etc/passwd': it is neither in the folder of the first "
            "file nor in a package; add its folder to the package paths"
        ),
    ),
    "pose_of_a_stock_launch": (
        ('<include file="$(find vrx_gazebo)/launch/vrx.launch"><arg name="x" value="nan"/></include>'),
        "bay.launch:2: x:= y:= z:= R:= P:= Y:=: expected numbers, got 'nan 162.0 0.1 0.0 0.0 1.0'",
    ),
    "stock_launch_twice": (
        (
            '<include file="$(find vrx_gazebo)/launch/vrx.launch"/>\n<include file="$(find vrx_gaz'
            'ebo)/launch/vrx.launch"/>'
        ),
        (
            "bay.launch:3:1: <include> / args: a model named 'wamv' is spawned on line 2 already: each needs "
            "-model NAME of its own"
        ),
    ),
}
TREES = {
    "entity_bomb": (
        {"bay.world": XML + BOMB + WORLD % "&j;"},
        "bay.world",
        "bay.world:2:15: <!DOCTYPE>: document types and entities are not allowed; delete them",
    ),
    "document_type": (
        {"bay.world": '<!DOCTYPE sdf SYSTEM "http://127.0.0.1/sdf.dtd">\n' + WORLD % ""},
        "bay.world",
        "bay.world:1:48: <!DOCTYPE>: document types and entities are not allowed; delete them",
    ),
    "external_entity": (
        {"bay.launch": '<!DOCTYPE launch [<!ENTITY s SYSTEM "file:///etc/passwd">]>\n<launch>&s;</launch>'},
        "bay.launch",
        "bay.launch:1:18: <!DOCTYPE>: document types and entities are not allowed; delete them",
    ),
    "empty_file": (
        {"bay.world": ""},
        "bay.world",
        "bay.world:1:1: ends before its outermost element does, or is empty",
    ),
    "empty_launch_file": (
        {"bay.launch": ""},
        "bay.launch",
        "bay.launch:1:1: ends before its outermost element does, or is empty",
    ),
    "blank_file": ({"bay.sdf": "\n\n"}, "bay.sdf", "bay.sdf:3:1: ends before its outermost element does, or is empty"),
    "text": ({"bay.world": "hello"}, "bay.world", "bay.world:1:1: is not XML, which begins with '<'"),
    "bytes": (
        {"bay.world": bytes(range(256))},
        "bay.world",
        "bay.world:1:1: is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='",
    ),
    "latin_1": (
        {"bay.world": '<sdf><world name="bucht-müll"/></sdf>'.encode("latin-1")},
        "bay.world",
        "bay.world:1:26: is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='",
    ),
    "encoding_unknown": (
        {"bay.world": '<?xml version="1.0" encoding="klingon"?><sdf/>'},
        "bay.world",
        "bay.world:1:1: unknown encoding; save the file as UTF-8",
    ),
    "cut_off": (
        {"bay.world": (WORLD % "<include><uri>a</uri></include>")[:60]},
        "bay.world",
        "bay.world:1:59: the file ends before </include>, which ends the <include> of line 1",
    ),
    "too_large": (
        {"bay.world": b"<sdf>" + b" " * 4000000 + b"</sdf>"},
        "bay.world",
        "bay.world: more than 4 MB, the largest size that is read",
    ),
    "sdf_without_world": (
        {"bay.world": '<sdf version="1.6"/>'},
        "bay.world",
        "bay.world:1:1: <sdf>: expected <sdf> with a <world>; this <sdf> has none",
    ),
    "model_in_place_of_a_world": (
        {"bay.world": mod(LINK)},
        "bay.world",
        "bay.world:1:1: <sdf>: expected <sdf> with a <world>; this is a model",
    ),
    "robot_in_place_of_a_world": (
        {"bay.world": '<robot name="wamv"/>'},
        "bay.world",
        "bay.world:1:1: <robot> 'wamv': expected <sdf> with a <world>; this is the description of a robot",
    ),
    "launch_in_place_of_a_world": (
        {"bay.world": "<launch/>"},
        "bay.world",
        "bay.world:1:1: <launch>: expected <sdf> with a <world>; this is a launch file",
    ),
    "world_in_place_of_a_launch": (
        {"bay.launch": WORLD % ""},
        "bay.launch",
        "bay.launch:1:1: <sdf>: expected <launch>, got <sdf>",
    ),
    "html": (
        {"bay.world": "<html><body>404: Not Found</body></html>"},
        "bay.world",
        "bay.world:1:1: <html>: expected <sdf> with a <world>; got <html>",
    ),
    "missing_world": ({}, "bay.world", "bay.world: cannot be read: No such file or directory"),
    "missing_sdf": ({}, "bay.sdf", "bay.sdf: cannot be read: No such file or directory"),
    "missing_xacro": ({}, "bay.world.xacro", "bay.world.xacro: cannot be read: No such file or directory"),
    "missing_template": ({}, "bay.sdf.erb", "bay.sdf.erb: cannot be read: No such file or directory"),
    "missing_launch": ({}, "bay.launch", "no launch file named 'bay.launch'; did you mean 'vrx.launch'?"),
    "missing_folder": ({}, "bay", "no file or folder 'bay'"),
    "name_too_long": (
        {},
        "x" * 3000 + ".world",
        (
            "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxxx…xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxx.world: cannot be read: File name too long"
        ),
    ),
    "name_of_a_launch_too_long": (
        {},
        "x" * 3000 + ".launch",
        (
            "no launch file named 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxxxxx."
            "launch'; known: demo_thrusterconfigs.launch, dock.launch, gymkhana.launch, marina.launch, naviga"
            "tion_task.launch, ocean_demos.launch, ocean_world.launch, ocean_world_buoys.launch, perception_t"
            "ask.launch, sandisland.launch, scan_and_dock.launch, scan_dock_deliver.launch and 6 more"
        ),
    ),
    "name_with_a_hash": (
        {"bay#1.world": WORLD % ""},
        "bay#1.world",
        (
            "bay#1.world:1:20: <world> 'bay': the path of the file has a '#', which stands for what follows i"
            "t, a model: rename it"
        ),
    ),
    "folder_called_world": (
        {"bay.world/a.txt": ""},
        "bay.world",
        "no file to import in bay.world: none ends in .world, .world.xacro, .launch, .sdf, .sdf.erb",
    ),
    "folder_of_nothing": (
        {"bay/a.txt": ""},
        "bay",
        "no file to import in bay: none ends in .world, .world.xacro, .launch, .sdf, .sdf.erb",
    ),
    "other_kind": (
        {"bay.yaml": "sea: {}"},
        "bay.yaml",
        (
            "'bay.yaml' cannot be imported: expected a file that ends in .world, .world.xacro, .launch, .sdf,"
            " .sdf.erb, or a folder"
        ),
    ),
    "pipe": ({"bay.world": "|pipe"}, "bay.world", "bay.world: cannot be read: it is a pipe, not a file"),
    "pipe_called_sdf": ({"bay.sdf": "|pipe"}, "bay.sdf", "bay.sdf: cannot be read: it is a pipe, not a file"),
    "pipe_called_launch": ({"bay.launch": "|pipe"}, "bay.launch", "bay.launch: not a file"),
    "pipe_called_template": (
        {"bay.sdf.erb": "|pipe"},
        "bay.sdf.erb",
        "bay.sdf.erb: cannot be read: it is a pipe, not a file",
    ),
    "pipe_called_xacro": (
        {"bay.world.xacro": "|pipe"},
        "bay.world.xacro",
        "bay.world.xacro: cannot be read: it is a pipe, not a file",
    ),
    "device": ({"bay.world": "->/dev/zero"}, "bay.world", "bay.world: cannot be read: it is a device, not a file"),
    "link_to_nothing": (
        {"bay.world": "->nowhere.world"},
        "bay.world",
        "bay.world: cannot be read: No such file or directory",
    ),
    "link_to_itself": (
        {"bay.world": "->bay.world"},
        "bay.world",
        "bay.world: cannot be read: Too many levels of symbolic links",
    ),
    "folder_of_wrong_files": (
        {"bay/a.world": "", "bay/b.launch": "<launch>", "bay/c.sdf": "|pipe"},
        "bay",
        (
            "bay/a.world:1:1: ends before its outermost element does, or is empty\n"
            "bay/b.launch:1:9: the file ends before </launch>, which ends the <launch> of line 1\n"
            "bay/c.sdf: cannot be read: it is a pipe, not a file"
        ),
    ),
    "launch_files_in_a_circle": (
        {
            "a.launch": '<launch><include file="$(dirname)/b.launch"/></launch>',
            "b.launch": '<launch>\n<include file="$(dirname)/a.launch"/></launch>',
        },
        "a.launch",
        "a.launch: launch files include each other: a.launch > b.launch > a.launch",
    ),
    "launch_files_that_double": (
        {
            f"a{i}.launch": "<launch>" + f'<include file="$(dirname)/a{i + 1}.launch"/>' * 2 + "</launch>"
            for i in range(12)
        }
        | {"a12.launch": "<launch/>"},
        "a0.launch",
        "a10.launch: more than 200 launch files in one",
    ),
    "launch_files_too_deep": (
        {f"a{i}.launch": f'<launch><include file="$(dirname)/a{i + 1}.launch"/></launch>' for i in range(30)},
        "a0.launch",
        "a20.launch: launch files include each other deeper than 20 levels",
    ),
    "argument_that_an_included_file_has_not": (
        {
            "a.launch": ('<launch>\n<include file="$(dirname)/b.launch"><arg name="x" value="1"/></include></launch>'),
            "b.launch": '<launch><arg name="y" default="2"/></launch>',
        },
        "a.launch",
        "a.launch:2:1: <include>: no argument named 'x'; known: y",
    ),
    "link_in_a_launch_out_of_its_folder": (
        {"a.launch": '<launch>\n<include file="$(dirname)/b.launch"/></launch>', "b.launch": "->/etc/passwd"},
        "a.launch",
        (
            "a.launch:2:1: <include>: may not read 'b.launch': it is neither in the folder of the first file "
            "nor in a package; add its folder to the package paths"
        ),
    ),
    "models_in_a_circle": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.sdf": mod("<include><uri>model://b</uri></include>", "a"),
            "b/model.sdf": mod("<include><uri>model://a</uri></include>", "b"),
        },
        "bay.world",
        "b/model.sdf:3:1: objects[0].model: this object contains itself: a > b > a",
    ),
    "model_in_itself": (
        {"a/model.sdf": mod("<include><uri>model://a</uri></include>", "a")},
        "a/model.sdf",
        "a/model.sdf:3:1: objects[0].model: this object contains itself: a > a",
    ),
    "models_too_deep": (
        {f"a{i}/model.sdf": mod(f"<include><uri>model://a{i + 1}</uri></include>", f"a{i}") for i in range(40)}
        | {"a40/model.sdf": mod(LINK), "bay.world": WORLD % "<include><uri>model://a0</uri></include>"},
        "bay.world",
        "a7/model.sdf:3:1: objects[0].model: more than 8 levels of objects in objects",
    ),
    "folder_of_a_model_is_a_link": (
        {"bay.world": WORLD % "<include><uri>model://a</uri></include>", "a": "->/outside"},
        "bay.world",
        "bay.world:1:38: <include> 'model://a': model 'a' is a link that leads out of @DIR/ws/src",
    ),
    "model_is_a_link": (
        {"bay.world": WORLD % "<include><uri>model://a</uri></include>", "a/model.sdf": "->/outside/model.sdf"},
        "bay.world",
        ("bay.world:1:38: objects[0].model: 'model.sdf' of model 'a' is a link that leads out of its folder"),
    ),
    "model_config_is_a_link": (
        {"bay.world": WORLD % "<include><uri>model://a</uri></include>", "a/model.config": "->/outside/model.sdf"},
        "bay.world",
        ("bay.world:1:38: objects[0].model: 'model.config' of model 'a' is a link that leads out of its folder"),
    ),
    "model_config_upwards": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.config": "<model>\n<sdf>../b.sdf</sdf></model>",
        },
        "bay.world",
        "a/model.config:2:1: <sdf>: expected the name of a file in this folder, got '../b.sdf'",
    ),
    "model_config_absolute": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.config": "<model>\n<sdf>/etc/passwd</sdf></model>",
        },
        "bay.world",
        "a/model.config:2:1: <sdf>: expected the name of a file in this folder, got '/etc/passwd'",
    ),
    "model_config_names_nothing": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.config": "<model>\n<sdf>a.sdf</sdf></model>",
        },
        "bay.world",
        "a/model.config:2:1: <sdf>: expected the name of a file in this folder, got 'a.sdf'",
    ),
    "model_config_of_a_long_name": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.config": "<model>\n<sdf version='²'>" + "x" * 5000 + "</sdf></model>",
        },
        "bay.world",
        (
            "a/model.config:2:1: <sdf>: expected the name of a file in this folder, got 'xxxxxxxxxxxxxxxxxxxx"
            "xxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxxxxxx'"
        ),
    ),
    "model_without_anything": (
        {"a/model.sdf": mod("", "a")},
        "a/model.sdf",
        "a/model.sdf:2:1: <model> 'a': a model without links or includes is nothing",
    ),
    "sdf_without_model": (
        {"a/model.sdf": "<sdf/>"},
        "a/model.sdf",
        "a/model.sdf:1:1: <sdf>: expected <sdf> with a <model>",
    ),
    "template_without_layout": (
        {"model.sdf.erb": "<sdf/>"},
        "model.sdf.erb",
        (
            "model.sdf.erb:1: layout: expected `layout = ['X  X', ...]`: a template is Ruby, of which only th"
            "is list is read"
        ),
    ),
    "template_of_code": (
        {"model.sdf.erb": ERB % "`touch owned`.split"},
        "model.sdf.erb",
        (
            "model.sdf.erb:1: layout: expected `layout = ['X  X', ...]`: a template is Ruby, of which only th"
            "is list is read"
        ),
    ),
    "template_with_code_in_its_list": (
        {"model.sdf.erb": ERB % "['X' * 10, true]"},
        "model.sdf.erb",
        ("model.sdf.erb:3: layout: expected rows in quotes, and true or false at last, got ''X' * 10, true'"),
    ),
    "template_with_code_after_its_list": (
        {"model.sdf.erb": ERB % "['X'] * 10"},
        "model.sdf.erb",
        (
            "model.sdf.erb:3: layout: expected `layout = ['X  X', ...]`: a template is Ruby, of which only th"
            "is list is read"
        ),
    ),
    "template_with_a_call_after_its_list": (
        {"model.sdf.erb": ERB % "['X', system('touch owned')]"},
        "model.sdf.erb",
        ("model.sdf.erb:3: layout: expected rows in quotes, and true or false at last, got 'system('touch owned')'"),
    ),
    "template_never_closed": (
        {"model.sdf.erb": "layout = ['X',"},
        "model.sdf.erb",
        (
            "model.sdf.erb:1: layout: expected `layout = ['X  X', ...]`: a template is Ruby, of which only th"
            "is list is read"
        ),
    ),
    "template_of_many_beginnings": (
        {"model.sdf.erb": "layout=[" * 400000},
        "model.sdf.erb",
        (
            "model.sdf.erb:1: layout: expected `layout = ['X  X', ...]`: a template is Ruby, of which only th"
            "is list is read"
        ),
    ),
    "template_without_blocks": (
        {"model.sdf.erb": ERB % "['x x', true]"},
        "model.sdf.erb",
        "model.sdf.erb:3: layout: no X in it: a block is a capital X",
    ),
    "template_of_a_long_row": (
        {"model.sdf.erb": ERB % f"['{'X' * 30000}', true]"},
        "model.sdf.erb",
        "model.sdf.erb:3: docks[0].layout[0]: 1 rows of up to 30000 cells; at most 10000 cells",
    ),
    "template_of_many_rows": (
        {"model.sdf.erb": ERB % ("[" + "'X',\n" * 300 + "true]")},
        "model.sdf.erb",
        (
            "model.sdf.erb:3: layout: expected rows in quotes, and true or false at last, got ''X',\\n'X',\\n'X"
            "',\\n'X',\\n'X',\\n'X',\\n'X',\\n'X',…\\n'X',\\n'X',\\n'X',\\ntrue'"
        ),
    ),
}
ARGUMENTS = {
    "argument_that_no_launch_file_declares": (
        {"a.launch": '<launch><arg name="x" default="1"/></launch>'},
        "a.launch",
        {"z": "1"},
        "a.launch: z:=: no argument named 'z'; known: x",
    ),
    "argument_of_an_include_alone": (
        {
            "a.launch": (
                '<launch><include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="paus'
                'ed" value="true"/></include></launch>'
            )
        },
        "a.launch",
        {"paused": "false"},
        "a.launch: paused:=: no argument named 'paused'; known: none",
    ),
    "argument_of_a_world": (
        {"bay.world": WORLD % ""},
        "bay.world",
        {"x": "1"},
        "bay.world: x:=: no argument named 'x'; known: none",
    ),
    "argument_that_no_xacro_declares": (
        {"bay.world.xacro": '<sdf xmlns:xacro="x"><xacro:arg name="gain" default="1"/><world/></sdf>'},
        "bay.world.xacro",
        {"gian": "1"},
        "bay.world.xacro: gian:=: no argument named 'gian'; did you mean 'gain'?",
    ),
    "argument_of_a_folder": (
        {"bay/bay.world": WORLD % ""},
        "bay",
        {"x": "1"},
        "arguments NAME:=VALUE are for one launch file or xacro, not for the folder bay",
    ),
    "argument_of_a_stock_launch": (
        {},
        "vrx.launch",
        {"thruster": "H"},
        (
            "vrx.launch: no argument of vrx.launch named 'thruster'; known: world, gui, verbose, extra_gazebo"
            "_args, namespace, x, y, z, P, R, Y, thrust_config and 8 more"
        ),
    ),
    "pose_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"x": "1e400"},
        "vrx.launch: x:= y:= z:= R:= P:= Y:=: expected numbers, got '1e400 162.0 0.1 0.0 0.0 1.0'",
    ),
    "world_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"world": "nowhere.world"},
        "nowhere.world: cannot be read: No such file or directory",
    ),
    "description_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"urdf": "nowhere.urdf"},
        "nowhere.urdf: cannot be read: No such file or directory",
    ),
    "pipe_for_a_description": (
        {"boat.urdf": "|pipe"},
        "vrx.launch",
        {"urdf": "boat.urdf"},
        "boat.urdf: cannot be read: it is a pipe, not a file",
    ),
}
IGNORED = {
    "plugin_unknown": (
        '<plugin filename="libmagic.so" name="m"/>',
        "bay.world:3: <plugin> 'm' ignored: no such plugin here",
    ),
    "plugin_without_a_file": ("<plugin/>", "bay.world:3: <plugin> ignored: no such plugin here"),
    "model_missing": (
        "<include><uri>model://galleon</uri></include>",
        (
            "bay.world:3: <include> 'model://galleon' ignored: no model named 'galleon'; is its folder on GAZ"
            "EBO_MODEL_PATH?"
        ),
    ),
    "model_almost_known": (
        "<include><uri>model://surmark4610</uri></include>",
        (
            "bay.world:3: <include> 'model://surmark4610' ignored: no model named 'surmark4610'; did you mean"
            " 'surmark46104'?"
        ),
    ),
    "model_of_a_server": (
        "<include><uri>https://fuel.gazebosim.org/1.0/someone/models/galleon</uri></include>",
        (
            "bay.world:3: <include> 'https://fuel.gazebosim.org/1.0/someone/models/galleon' ignored: no model"
            " named 'galleon'; is its folder on GAZEBO_MODEL_PATH?"
        ),
    ),
    "element_unknown": ("<weather/>", "bay.world:3: <weather> ignored: unknown here"),
    "element_known": ('<road name="r"/>', "bay.world:3: <road> 'r' ignored: roads"),
    "message_of_another_topic": (
        '<plugin filename="libPublisherPlugin.so"><message topic="/a"/></plugin>',
        "bay.world:3: <plugin> ignored: it publishes what nothing here listens to",
    ),
    "light_of_a_lamp": (
        '<light type="point" name="lamp"/>',
        "bay.world:3: <light> 'lamp' ignored: every world has one sun, where ours is",
    ),
    "second_task": (
        (
            "<spherical_coordinates><latitude_deg>-33.7</latitude_deg><longitude_deg>150.6</longi"
            "tude_deg></spherical_coordinates>\n"
        )
        + SCORING
        + "\n"
        + SCORING,
        "bay.world:5: <plugin> 'a' ignored: a world has one task: that of the first scoring plugin",
    ),
    "mesh_outside": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>file:///etc/passwd.stl</uri></mesh></geometry></visual></link></model>"
        ),
        "bay.world:3: <mesh> ignored: a mesh outside the model's folder: 'file:///etc/passwd.stl'",
    ),
    "mesh_upwards": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>../../a.stl</uri></mesh></geometry></visual></link></model>"
        ),
        "bay.world:3: <mesh> ignored: a mesh outside the model's folder: '../../a.stl'",
    ),
    "mesh_missing": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>a.stl</uri></mesh></geometry></visual></link></model>"
        ),
        "bay.world:3: <mesh> ignored: no such mesh: 'a.stl'",
    ),
    "mesh_of_a_long_name": (
        ('<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><mesh><uri>')
        + "x" * 5000
        + ".stl</uri></mesh></geometry></visual></link></model>",
        ("bay.world:3: <mesh> ignored: no such mesh: 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxx.stl'"),
    ),
    "mesh_without_uri": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh/></geometry></visual></link></model>"
        ),
        "bay.world:3: <mesh> ignored: no such mesh: ''",
    ),
    "shape_unknown": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><h'
            "eightmap/></geometry></visual></link></model>"
        ),
        "bay.world:3: <visual> 'v' ignored: no shape like <heightmap> here",
    ),
    "second_world": (
        '</world><world name="other">',
        "bay.world:3: <world> 'other' ignored: a file has one world: the first",
    ),
}


def world(body):
    """The file of a world; its content begins on line 3."""
    return f'<sdf version="1.6">\n<world name="bay">\n{body}\n</world>\n</sdf>\n'


def xacro(body):
    """The same as a xacro."""
    return world(body).replace("<sdf ", '<sdf xmlns:xacro="http://ros.org/wiki/xacro" ')


CASES = {
    **{key: ({"bay.world": world(body)}, "bay.world", None, said) for key, (body, said) in WORLDS.items()},
    **{key: ({"bay.world.xacro": xacro(body)}, "bay.world.xacro", None, said) for key, (body, said) in XACRO.items()},
    **{key: ({"bay.launch": f"<launch>\n{body}\n</launch>\n"}, "bay.launch", None, said)
       for key, (body, said) in LAUNCHES.items()},
    **{key: (files, target, None, said) for key, (files, target, said) in TREES.items()},
    **ARGUMENTS,
}  # fmt: skip


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The current folder, three below one with a model that nothing may read."""
    outside = tmp_path / "outside"
    outside.mkdir()
    secret = '<sdf version="1.6"><model name="a"><static>true</static><link name="l"/></model></sdf>'
    (outside / "model.sdf").write_text(secret, encoding="utf-8")
    folder = tmp_path / "ws" / "src" / "home"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    return folder


def written(files, home):
    """Write files: text, bytes, a pipe, or a link."""
    for name, content in files.items():
        path = home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, bytes):
            path.write_bytes(content)
        elif content == "|pipe":
            os.mkfifo(path)
        elif content.startswith("->"):
            path.symlink_to(content[2:].replace("/outside", str(home.parents[2] / "outside")))
        else:
            path.write_text(content, encoding="utf-8")


@pytest.mark.parametrize("case", CASES)
def test_a_broken_file_says_what_and_where(case, home):
    files, target, arguments, said = CASES[case]
    written(files, home)
    begin = time.process_time()
    with pytest.raises(VrxError) as caught:
        import_files(Path(target), arguments)
    assert str(caught.value).replace(str(home.parents[2]), "@DIR") == said
    assert time.process_time() - begin < SECONDS
    assert not Path("owned").exists()


@pytest.mark.parametrize("case", WORLDS)
def test_a_world_that_is_loaded_says_the_same(case, home):
    body, said = WORLDS[case]
    Path("bay.world").write_text(world(body), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_world("bay.world")
    assert str(caught.value) == said


@pytest.mark.parametrize("case", IGNORED)
def test_what_is_ignored_is_noted(case, home):
    body, said = IGNORED[case]
    Path("bay.world").write_text(world(body), encoding="utf-8")
    notes = dict.fromkeys(note for note in import_files(Path("bay.world")).notes if note.fate != "taken over")
    lines = [f"{note.place.file.name}:{note.place.line}: {note.what} {note.fate}: {note.ours}" for note in notes]
    assert lines == [said]


def test_there_are_enough_broken_files():
    assert len(CASES) >= 200


def test_no_message_speaks_of_python():
    text = "\n".join(said for *_, said in CASES.values())
    for word in ("Traceback", "expat", "object has no attribute", "<class", "NoneType", "Errno"):
        assert word not in text
