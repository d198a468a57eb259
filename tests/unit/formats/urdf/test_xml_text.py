"""The namespace of a URDF's names."""

import pytest

from vrx_mj.config.fleet import Order
from vrx_mj.formats.urdf.reader import in_namespace, namespace_of
from vrx_mj.mjcf.build import boat_urdf

TEXT = """<robot name="wamv">
  <link name="wamv/base_link"><visual><geometry><mesh filename="wamv/hull.dae"/></geometry></visual></link>
  <link name='wamv/mast'/>
  <joint name="wamv/mast_joint" type="fixed"><parent link="wamv/base_link"/><child link="wamv/mast"/></joint>
  <gazebo reference="wamv/mast"><material>Gazebo/White</material></gazebo>
  <gazebo><plugin name="wamv_truth" filename="libgazebo_ros_p3d.so">
    <robotNamespace>/wamv</robotNamespace>
    <bodyName> wamv/base_link</bodyName><topicName>/wamv/truth</topicName><frameName>map</frameName>
  </plugin></gazebo>
</robot>"""


def test_names_and_what_refers_to_them_get_the_namespace_and_files_do_not():
    assert in_namespace(TEXT, "a.b") == (
        TEXT.replace("wamv/", "a.b/").replace("a.b/hull.dae", "wamv/hull.dae").replace(">/wamv<", ">/a.b<")
    )
    assert namespace_of(in_namespace(TEXT, "a.b")) == "a.b"
    assert in_namespace(in_namespace(TEXT, "other"), "wamv") == TEXT


@pytest.mark.parametrize("text", ["", "no XML", TEXT.replace("wamv/", ""), TEXT])
def test_text_without_a_namespace_or_with_the_same_one_stays(text):
    assert in_namespace(text, "wamv") == text


def test_it_is_what_the_namespace_argument_of_our_xacro_gives():
    """But for the names that VRX's files have whatever the argument is."""
    given = boat_urdf(Order("wamv"), "other")
    made = in_namespace(boat_urdf(Order("wamv"), "wamv"), "other")
    differing = [(a, b) for a, b in zip(given.splitlines(), made.splitlines(), strict=True) if a != b]
    assert differing == []
