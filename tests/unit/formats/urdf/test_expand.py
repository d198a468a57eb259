"""Expansion against the xacro package itself, and where files and packages are found."""

import subprocess
import sys
import threading
import warnings
from pathlib import Path
from xml.etree.ElementTree import canonicalize

import pytest
import xacro
import xacro.substitution_args

from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.urdf.expand import arguments, expand, own_packages
from vrx_mj.ros.packages import write_launch_packages

HEAD = '<robot name="boat" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
PARTS = {
    "parts.xacro": HEAD
    + """
  <xacro:property name="thick" value="0.05"/>
  <xacro:macro name="post" params="name height:=1.5 *origin **extra">
    <link name="${name}"><cylinder length="${height}" radius="${thick / 2}"/><xacro:insert_block name="origin"/></link>
    <xacro:insert_block name="extra"/>
  </xacro:macro>
</robot>""",
    "more/one.xacro": HEAD + '<link name="one"/></robot>',
    "more/two.xacro": HEAD + '<link name="two"/></robot>',
    "data.yaml": "hull: {length: 4.9, beams: [2.4, 2.5]}\nnames: [a, b]\n"
    "angle: !degrees 90\nstep: !millimeters 20 * 2\n",
}
BODIES = {
    "properties": """
  <xacro:property name="a" value="2"/><xacro:property name="b" value="${a * 3}"/><xacro:property name="t" value="'12'"/>
  <xacro:property name="d" default="7"/><xacro:property name="a" default="9"/>
  <xacro:property name="flag" value="true"/><xacro:property name="lst" value="${[1, 2, [3, a]]}"/>
  <a b="${b}" t="${t}" d="${d}" n="${a}" f="${flag}" l="${lst}" s="x${a}y${b}" e="$${a} $$(arg x) $5"/>
  <xacro:property name="a" value="5"/><c>${a} and ${b / 4}</c>
  <xacro:property name="a" remove="true"/><xacro:property name="a" default="6"/><e f="${a}"/>
  <xacro:property name="lazy" value="${later}"/><xacro:property name="later" value="1e-3"/><g h="${lazy}"/>
  <xacro:property name="now" value="${later}" lazy_eval="false"/><xacro:property name="later" value="8"/><g h="${now}"/>
  <xacro:property name="under" value="1_0"/><g h="${under}"/>""",
    "math": """
  <o rpy="0 ${radians(15)} ${-pi/2}" x="${sin(pi / 6)} ${math.cos(0)} ${2**0.5}" y="${1 if 3 &gt; 2 else 0}"/>
  <o i="${7 // 2} ${7 % 4} ${7 / 2}" m="${max(1, 2, 3)} ${round(2.567, 2)} ${abs_(3) if False else fabs(-1)}"/>
  <o l="${len('abc')} ${[x * 2 for x in [1, 2]]} ${list(map(float, '1 2'.split()))} ${sum_ if False else str(3)}"/>
  <o p="${python.abs(-2)} ${python.sum([1, 2])} ${'%.2f' % 1.005} ${1e400} ${0.1 + 0.2} ${'a' 'b'.upper()}"/>""",
    "conditions": """
  <xacro:property name="n" value="3"/>
  <xacro:if value="${n &gt; 2}"><yes/><xacro:unless value="false"><inner/></xacro:unless></xacro:if>
  <xacro:if value="0"><no/></xacro:if><xacro:unless value="${n == 3}"><no/></xacro:unless>
  <xacro:if value="true"><yes/></xacro:if><xacro:if value="${not n in [1, 2]}">text ${n}</xacro:if>
  <xacro:if value="$(arg on)"><armed by="$(arg by)"/></xacro:if>""",
    "macros": """
  <xacro:property name="size" value="11"/>
  <xacro:macro name="leaf" params="name x:=1 y:='2 3' z:=${x_ if False else 4} size:=^ other:=^|5 w=6">
    <leaf name="${name}" v="${x} ${y} ${z} ${size} ${other} ${w}"/>
  </xacro:macro>
  <!-- dropped -->
  <xacro:leaf name="a"/><xacro:leaf name="b" x="${size + 1}" y="" size="0" other="z"/>
  <xacro:macro name="tree" params="n"><node n="${n}"/>
    <xacro:if value="${n &gt; 0}"><xacro:tree n="${n - 1}"/><xacro:leaf name="t${n}"/></xacro:if></xacro:macro>
  <xacro:tree n="3"/>
  <xacro:call macro="${'le' + 'af'}" name="dynamic"/>
  <xacro:macro name="leaf" params="name"><redefined name="${name}"/></xacro:macro><xacro:leaf name="c"/>
  <xacro:macro name="setter" params="v"><xacro:property name="out" value="${v * 2}" scope="parent"/>
    <xacro:property name="world" value="${v}" scope="global"/></xacro:macro>
  <xacro:setter v="21"/><got v="${out} ${world}"/>""",
    "blocks": """
  <xacro:macro name="part" params="name *origin **rest"><p name="${name}"><xacro:insert_block name="origin"/>
    <xacro:insert_block name="rest"/><xacro:insert_block name="rest"/></p></xacro:macro>
  <xacro:property name="k" value="2"/>
  <xacro:part name="a"><origin xyz="${k} 0 0"/><all><x y="${k}"/><z/></all></xacro:part>
  <xacro:property name="kept"><u v="${k}"/><w/></xacro:property>
  <xacro:insert_block name="kept"/>
  <xacro:part name="b"><xacro:if value="1"><origin/></xacro:if><all/></xacro:part>""",
    "elements": """
  <xacro:element xacro:name="${'na' + 'med'}" a="1"><in/></xacro:element>
  <host><xacro:attribute name="x${1}" value="y"/></host>
  <!-- kept ${1 + 1} --><t/>
  <!-- xacro:eval-comments --><!-- ${1 + 1} --><u/>
  <ns:tag xmlns:ns="http://ns" ns:a="${3}"/><![CDATA[raw ${1}]]>""",
    "includes": """
  <xacro:include filename="parts.xacro"/><xacro:include filename="more/*.xacro"/>
  <xacro:include filename="parts.xacro" ns="p"/><xacro:include filename="none.xacro" optional="true"/>
  <xacro:include filename="$(find far)/parts.xacro"/>
  <xacro:property name="file" value="more/one.xacro"/><xacro:include filename="${file}"/>
  <xacro:post name="a" height="2"><origin/><x/></xacro:post>
  <xacro:p.post name="b"><origin z="${p.thick}"/><x/></xacro:p.post><q v="${thick} ${p.thick * 2}"/>""",
    "yaml": """
  <xacro:property name="data" value="${xacro.load_yaml('data.yaml')}"/>
  <y a="${data['hull']['length']} ${data.hull.beams[1]} ${data.names} ${data.angle} ${data.step}"/>
  <xacro:property name="made" value="${dict(a=1, b=dict(c=2))}"/>
  <y a="${xacro.dotify(made).b.c} ${[k for k in data.keys()]} ${data.hull.get('x', 3)} ${'hull' in data}"/>
  <y t="${xacro.tokenize('1, 2;3')} ${xacro.arg('by')} ${xacro.message('quiet')}"/>""",
    "arguments": """
  <xacro:arg name="on" default="true"/><xacro:arg name="size" default="${2 * 3}"/><xacro:arg name="by" default="no"/>
  <a on="$(arg on)" size="$(arg size)" both="$(arg on)/$(arg by)" n="${$(arg size) + 1}" f="$(find far)/mesh.obj"/>
  <a e="$(eval size * 2 + 1)" t="$(eval on and 5)" o="$(optenv VRX_MJ_SURELY_UNSET a b)"/>""",
}


@pytest.fixture
def folder(tmp_path):
    for name, text in PARTS.items():
        for place in (tmp_path, tmp_path / "far"):
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_text(text, encoding="utf-8")
    return tmp_path


def write(folder, body, name="boat.urdf.xacro"):
    (folder / name).write_text(f"{HEAD}{body}\n</robot>\n", encoding="utf-8")
    return folder / name


def theirs(file, monkeypatch, packages, **mappings):
    """What the xacro package itself makes of a file."""
    monkeypatch.setattr(xacro.substitution_args, "_eval_find", lambda name: str(packages[name]))
    return xacro.process_file(str(file), mappings=mappings).toprettyxml(indent="  ")


def same(ours, other):
    return canonicalize(ours, strip_text=True) == canonicalize(other, strip_text=True)


@pytest.mark.parametrize("name", BODIES)
def test_the_result_is_that_of_xacro(name, folder, monkeypatch):
    file, packages, given = write(folder, BODIES[name]), {"far": folder / "far"}, {"on": "1", "by": "hand"}
    ours = expand(file, arguments=given)
    assert same(ours, theirs(file, monkeypatch, packages, **given))


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"namespace": "robo2", "vrx_sensors_enabled": "true"},
        {"thruster_config": "X", "camera_enabled": "true", "lidar_enabled": "true"},
    ],
    ids=["plain", "sensors", "x"],
)
def test_our_own_boat_is_that_of_xacro(given, monkeypatch):
    packages = own_packages()
    file = packages["wamv_gazebo"] / "urdf" / "wamv_gazebo.urdf.xacro"
    assert same(expand(file, arguments=given), theirs(file, monkeypatch, packages, **given))


def test_the_text_is_pretty_and_has_no_path_in_it(folder):
    file = write(folder, '<link name="a"><box size="${1 + 1}"/></link>')
    lines = ['<?xml version="1.0" ?>', '<robot name="boat">', '  <link name="a">', '    <box size="2"/>', "  </link>"]
    assert expand(file) == "\n".join([*lines, "</robot>", ""])


@pytest.mark.slow
def test_the_xacro_package_stays_in_its_own_process(folder):
    file = write(folder, BODIES["math"])
    code = f"from vrx_mj.formats.urdf.expand import expand; expand({str(file)!r}); print('xacro' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", f"import sys; {code}"], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_a_plain_urdf_stays_as_it_is(folder):
    text = '<robot name="boat"><link name="a"/><!-- c --><gazebo><x>3 $ 4</x></gazebo></robot>'
    (folder / "a.urdf").write_text(text, encoding="utf-8")
    assert same(expand(folder / "a.urdf"), text)


def test_a_value_in_an_attribute_element_may_be_a_number(folder):
    assert '<host x="3"/>' in expand(write(folder, '<host><xacro:attribute name="x" value="${1 + 2}"/></host>'))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            '<xacro:element xacro:name="${1}"/>',
            "2:1: <1>: cannot be expanded: 'int' object has no attribute 'startswith'",
        ),
        (
            '<a><xacro:attribute name="${1}" value="2"/></a>',
            "2:4: <xacro:attribute>: cannot be expanded: 'int' object has no attribute 'split'",
        ),
        (
            '<xacro:property name="${1}" value="1"/>',
            "2:1: <xacro:property>: cannot be expanded: compile() arg 1 must be a string, bytes or AST object",
        ),
        (
            '<xacro:property name="a" value="1" scope="parent"/>',
            "2:1: <xacro:property>: cannot be expanded: 'dict' object has no attribute '_setitem'",
        ),
        (
            '<xacro:arg name="c" default="H"/><a b="$(eval arg(\'c\') == \'H\')"/>',
            "2:40: <a>: $(eval arg('c'): '(' was never closed",
        ),
        (
            '<xacro:property name="b"><xacro:insert_block name="b"/></xacro:property><xacro:insert_block name="b"/>',
            "2:26: <xacro:insert_block>: nested too deeply; does something refer to itself?",
        ),
    ],
)
def test_what_xacro_would_fail_on_without_a_word(body, message, folder, monkeypatch):
    monkeypatch.chdir(folder)
    write(folder, body)
    with pytest.raises(ConfigError) as caught:
        expand(Path("boat.urdf.xacro"))
    assert str(caught.value) == f"boat.urdf.xacro:{message}"


def test_the_same_file_gives_the_same_text_in_many_threads(folder):
    files = [write(folder, body, f"{name}.xacro") for name, body in BODIES.items()]

    def make(file):
        return expand(file, arguments={"on": "1", "by": "x"})

    alone = [make(file) for file in files]
    found = {}
    threads = [threading.Thread(target=lambda n=n: found.update({n: [make(f) for f in files]})) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[number] for number in range(4)] == [alone] * 4


def test_the_xacro_that_others_use_is_left_alone(folder, capfd):
    before = dict(vars(xacro))
    write(folder, '<a b="${1 + nothing}"/>', "bad.xacro")
    for name, body in BODIES.items():
        expand(write(folder, body, f"{name}.xacro"), arguments={"on": "1", "by": "x"})
    with pytest.raises(ConfigError):
        expand(folder / "bad.xacro")
    assert dict(vars(xacro)) == before
    assert sys.modules["xacro"] is xacro
    assert capfd.readouterr() == ("", "")


def test_warnings_come_as_one(folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    file = write(
        folder,
        """<xacro:property name="pi" value="3"/>
<xacro:property name="a" value="1" lazzy="true"/>
<a b="${load_yaml('data.yaml')['names'][0]}${xacro.warning('mind the', 'step')}"/>
<xacro:include filename="none*.xacro"/>
<b>
${xacro.warning('in a text')}</b>
${xacro.warning('between elements')}""",
    )
    with pytest.warns(VrxWarning) as caught:
        expand(Path(file.name))
    (warning,) = caught
    assert str(warning.message) == (
        "boat.urdf.xacro: xacro warns\n"
        "boat.urdf.xacro:2: redefining global symbol: pi\n"
        "boat.urdf.xacro:3: xacro:property: unknown attribute(s): lazzy\n"
        "boat.urdf.xacro:4: Using load_yaml() directly is deprecated. Use xacro.load_yaml() instead.\n"
        "boat.urdf.xacro:4: mind the step\n"
        f'boat.urdf.xacro:5: Include tag\'s filename spec "{folder / "none*.xacro"}" matched no files.\n'
        "boat.urdf.xacro:6: in a text\n"
        "boat.urdf.xacro:1: between elements"
    )
    assert capfd.readouterr() == ("", "")


WRONG, LINES = "${1 / 0}", 40 * "\n"
SKIPPED = f'<xacro:if value="0"><a b="{WRONG}"/></xacro:if>'


@pytest.mark.parametrize(
    ("body", "line", "column"),
    [
        (f'{SKIPPED}\n<a b="{WRONG}"/>', 3, 7),
        (f'{SKIPPED}<a b="{WRONG}"/>', 2, len(SKIPPED) + 7),
        (f'<a{LINES[1:]}b="{WRONG}"/>', 41, 4),
        (f'<a{LINES}b="{WRONG}"/>', 2, 1),
        (f"<a>\n{WRONG}</a>", 3, 1),
    ],
    ids=["a line above", "before it", "line 40 of it", "line 41 of it", "begin of a line"],
)
def test_the_place_is_that_of_the_expression_in_its_element(folder, monkeypatch, body, line, column):
    """Not of an equal one before, which is not evaluated."""
    monkeypatch.chdir(folder)
    with pytest.raises(ConfigError) as caught:
        expand(write(Path(), body))
    (problem,) = caught.value.problems
    assert (problem.line, problem.column) == (line, column)


def test_odd_backslashes_make_no_warning(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert 'b="a\\d"' in expand(write(folder, r"""<a b="${'a\d'}"/>"""))


def test_arguments_lists_what_the_file_declares(folder):
    file = write(
        folder,
        '<xacro:arg name="z" default="1"/><xacro:if value="0"><xacro:arg name="a" default="${2}"/></xacro:if>'
        '<xacro:arg name="z" default="3"/>',
    )
    assert list(arguments(file).items()) == [("z", "1"), ("a", "${2}")]


def test_arguments_of_a_broken_file_is_an_error(folder, monkeypatch):
    monkeypatch.chdir(folder)
    write(folder, "<a>")
    with pytest.raises(ConfigError) as caught:
        arguments(Path("boat.urdf.xacro"))
    assert str(caught.value) == "boat.urdf.xacro:3:3: expected </a>, which ends the <a> of line 2"
    with pytest.raises(ConfigError) as caught:
        arguments(Path("none.xacro"))
    assert str(caught.value) == "none.xacro: cannot be read: No such file or directory"


def test_a_missing_file_is_an_error(folder, monkeypatch):
    monkeypatch.chdir(folder)
    for name in ("none.xacro", "far"):
        with pytest.raises(ConfigError) as caught:
            expand(Path(name))
        assert str(caught.value) == f"{name}: no such file"


def package(folder, name=None):
    folder.mkdir(parents=True, exist_ok=True)
    if name:
        (folder / "package.xml").write_text(f"<package><name>{name}</name></package>", encoding="utf-8")
    (folder / "x.xacro").write_text(f'{HEAD}<from folder="{folder.name}"/></robot>', encoding="utf-8")
    return folder


def found(file, name="pkg", **options):
    """The folder whose file an include of `$(find name)` reads."""
    text = write(file, f'<xacro:include filename="$(find {name})/x.xacro"/>')
    return expand(text, **options).split('folder="')[1].split('"')[0]


def test_packages_are_found_in_order(tmp_path):
    boat = tmp_path / "ws" / "boat" / "urdf"
    beside = package(boat / "pkg")
    assert found(boat) == "pkg"
    named = package(tmp_path / "paths" / "named_otherwise", "pkg")
    assert found(boat, package_paths=[named]) == "named_otherwise"
    package(tmp_path / "more" / "pkg")
    assert found(boat, package_paths=[tmp_path / "more"]) == "pkg"
    assert found(boat, package_paths=[tmp_path / "more" / "pkg"]) == "pkg"
    assert beside.is_dir()


def test_packages_may_be_relative_to_the_current_folder(tmp_path, monkeypatch):
    package(tmp_path / "parts" / "pkg")
    (tmp_path / "boat").mkdir()
    monkeypatch.chdir(tmp_path)
    assert found(Path("boat"), package_paths=[Path("parts")]) == "pkg"


def test_a_file_is_in_its_own_package(tmp_path):
    package(tmp_path / "my_boat", "my_boat_description")
    urdf = tmp_path / "my_boat" / "urdf"
    urdf.mkdir()
    assert found(urdf, "my_boat_description") == "my_boat"
    assert '<from folder="my_boat"/>' in expand(write(urdf, '<xacro:include filename="../x.xacro"/>'))


def test_ros_is_not_asked_for_packages(tmp_path, monkeypatch):
    package(tmp_path / "ros" / "pkg", "pkg")
    boat = tmp_path / "boat"
    boat.mkdir()
    for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        monkeypatch.setenv(name, str(tmp_path / "ros"))
    monkeypatch.chdir(boat)
    with pytest.raises(ConfigError) as caught:
        found(Path())
    assert str(caught.value) == (
        "boat.urdf.xacro:2:26: <xacro:include>: $(find pkg): no package named 'pkg'; "
        f"known: {', '.join(sorted(own_packages()))} "
        "(or add its folder to the package paths, or --missing ignore)"
    )


LIDAR = '<xacro:include filename="$(find lidar)/urdf/lidar.xacro"/>'


@pytest.mark.parametrize("include", [LIDAR, LIDAR.replace("$(find lidar)", "${xacro.arg('place')}")])
def test_missing_packages_may_be_ignored(folder, monkeypatch, include):
    monkeypatch.setenv("VRX_MJ_MISSING", "ignore")
    monkeypatch.chdir(folder)
    body = (
        f'<xacro:arg name="place" default="$(find lidar)"/>{include}<xacro:lidar at="0"><origin/></xacro:lidar><link/>'
    )
    with pytest.warns(VrxWarning) as told:
        text = expand(write(Path(), body))
    assert "lidar" not in text
    assert "<link/>" in text
    assert str(told[0].message).splitlines() == [
        "boat.urdf.xacro: not read, because packages are missing",
        "boat.urdf.xacro:2: no package named 'lidar'",
        "boat.urdf.xacro:2: no macro named 'lidar'",
    ]


def test_what_needs_a_value_of_a_missing_package_says_what_was_not_read(folder, monkeypatch):
    monkeypatch.setenv("VRX_MJ_MISSING", "ignore")
    monkeypatch.chdir(folder)
    with pytest.raises(ConfigError) as caught:
        expand(write(Path(), f'{LIDAR}<link name="${{lidar_mass}}"/>'))
    said = "name 'lidar_mass' is not defined; not read: boat.urdf.xacro:2: no package named 'lidar'"
    assert str(caught.value).endswith(said)


def test_without_a_missing_package_an_unknown_macro_is_an_error(folder, monkeypatch):
    monkeypatch.setenv("VRX_MJ_MISSING", "ignore")
    with pytest.raises(ConfigError, match="unknown macro name: xacro:lidar"):
        expand(write(folder, "<xacro:lidar/>"))


def test_own_packages_are_the_robots_with_a_package_file():
    ours = own_packages()
    assert {"wamv_description", "wamv_gazebo"} <= set(ours)
    assert all((folder / "package.xml").is_file() for folder in ours.values())


WAMV_FILE = "urdf/wamv_gazebo.urdf.xacro"


@pytest.fixture
def surrounded(tmp_path):
    """Files that stand on our WAM-V beside packages with the names of ours, as in a sourced workspace of VRX."""
    for name in ("wamv_description", "wamv_gazebo"):
        package(tmp_path / "vrx" / name, name)
    copies = tmp_path / "copies"
    write_launch_packages(copies)
    (tmp_path / "link.urdf.xacro").symlink_to(own_packages()["wamv_gazebo"] / WAMV_FILE)
    (tmp_path / "link_of_copy.urdf.xacro").symlink_to(copies / "wamv_gazebo" / WAMV_FILE)
    write(tmp_path, f'<xacro:include filename="{own_packages()["wamv_gazebo"] / WAMV_FILE}"/>', "including.xacro")
    return tmp_path


def test_what_our_macros_make_in_other_files_has_the_place_of_its_call(tmp_path):
    body = '<xacro:include filename="$(find wamv_gazebo)/urdf/components/wamv_gps.xacro"/>'
    body += '<xacro:include filename="$(find wamv_description)/urdf/shapes.xacro"/>'
    made = expand(write(tmp_path, f'{body}\n<xacro:property name="namespace" value="boat"/>\n<xacro:wamv_gps/>')).made
    assert {Path(file).parent for file in made.files} == {tmp_path}
    assert {line for _, line, _ in made.places[1:]} == {4}


@pytest.mark.parametrize(
    "file", ["link.urdf.xacro", f"copies/wamv_gazebo/{WAMV_FILE}", "link_of_copy.urdf.xacro", "including.xacro"]
)
def test_files_of_ours_find_ours_first(surrounded, file):
    alone = expand(own_packages()["wamv_gazebo"] / WAMV_FILE)
    found = expand(surrounded / file, package_paths=[surrounded / "vrx"])
    assert canonicalize(found).partition("<link")[2] == canonicalize(alone).partition("<link")[2]


def test_links_inside_the_folder_are_followed(folder):
    (folder / "alias.xacro").symlink_to(folder / "more" / "one.xacro")
    assert '<link name="one"/>' in expand(write(folder, '<xacro:include filename="alias.xacro"/>'))


def test_a_linked_robot_file_may_read_where_it_really_is(folder, tmp_path):
    real = write(folder, '<xacro:include filename="parts.xacro"/><a t="${thick}"/>')
    install = tmp_path / "install"
    install.mkdir()
    (install / "boat.urdf.xacro").symlink_to(real)
    (install / "parts.xacro").symlink_to(folder / "parts.xacro")
    assert '<a t="0.05"/>' in expand(install / "boat.urdf.xacro")


def test_dirname_is_the_folder_of_the_file_that_says_it(folder):
    write(folder / "more", '<d v="$(dirname)"/>', "dir.xacro")
    assert f'<d v="{folder / "more"}"/>' in expand(write(folder, '<xacro:include filename="more/dir.xacro"/>'))


def test_other_encodings_are_read(folder):
    text = f'<?xml version="1.0" encoding="iso-8859-1"?>\n{HEAD}<a name="Zürich ${{1 + 1}}"/></robot>'
    (folder / "l1.xacro").write_text(text, encoding="iso-8859-1")
    (folder / "bom.xacro").write_text(f'{HEAD}<a name="Zürich ${{1 + 1}}"/></robot>', encoding="utf-8-sig")
    assert 'name="Zürich 2"' in expand(folder / "l1.xacro")
    assert 'name="Zürich 2"' in expand(folder / "bom.xacro")


# Broken xacro files and the whole message that each must give: `tests/broken/xacro/CASE.xacro` and `CASE.expected`


BROKEN = Path(__file__).parents[3] / "broken" / "xacro"
CASES = sorted(BROKEN.glob("*.xacro"))


@pytest.mark.parametrize("file", CASES, ids=[file.stem for file in CASES])
def test_a_broken_file_says_what_and_where(file, monkeypatch):
    monkeypatch.chdir(BROKEN)
    with pytest.raises(ConfigError) as caught:
        expand(Path(file.name))
    assert str(caught.value) == file.with_suffix(".expected").read_text(encoding="utf-8").rstrip("\n")


def test_there_are_enough_broken_files():
    assert len(CASES) >= 50


def test_no_message_speaks_of_internals():
    text = "\n".join(file.read_text(encoding="utf-8") for file in BROKEN.glob("*.expected"))
    for word in ("XacroException", "Traceback", "expat", "object has no attribute", "<class", "None"):
        assert word not in text
