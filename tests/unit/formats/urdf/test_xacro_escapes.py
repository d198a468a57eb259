"""What a hostile xacro file tries, and that it gets nowhere: nothing is run, nothing outside is read.

Every attempt must end in a ConfigError or in an expansion. A canary file must not appear, and a secret beside the
robot folder, one in a linked file and one in the environment must be neither in a result nor in a message.
"""

import os
from pathlib import Path

import pytest
import xacro

from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf import expand as expand_module
from vrx_mj.formats.urdf.expand import expand

HEAD = '<robot name="boat" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
SECRET = "s3cret-harbour"

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")

PYTHON = r"""
__import__('os').system('touch CANARY')
open('CANARY', 'w')
open('CANARY', 'w').write('x')
os.system('touch CANARY')
().__class__
().__class__.__base__.__subclasses__()
[c for c in ().__class__.__base__.__subclasses__()]
''.__class__.__mro__[1]
(1).__class__
(0).real
'x'.format
'%s'.__mod__
str.format('x', 1)
str.format_map('x', 1)
'x'.format_map(dict(a=1))
f'x'
f'a' 'b'
lambda: 1
(lambda: open('CANARY', 'w'))()
sorted([1], key=lambda x: open('CANARY', 'w'))
(x := open('CANARY', 'w'))
[x := 1 for y in [1]]
[open('CANARY', 'w') for x in [1]]
[x for x in [1] if open('CANARY', 'w')]
(open('CANARY', 'w') for x in [1])
[y for __x in [1] for y in [__x]]
list(map(open, ['CANARY']))
list(filter(eval, ['1']))
max([1], key=open)
globals()
locals()
vars()
vars(math)
python.vars(math)
python.type(1)
python.type('X', (), dict(a=1))
python.hash('a')
python.isinstance(1, int)
dir()
type(1).mro()
object()
super()
getattr((), '__class__')
setattr(math, 'pi', 3)
delattr(math, 'pi')
hasattr(1, 'real')
eval('1')
exec('open("CANARY", "w")')
compile('1', 'a', 'eval')
breakpoint()
input()
print(1)
exit()
quit()
memoryview(b'a')
bytearray(9)
__builtins__
__builtins__.open('CANARY', 'w')
__name__
__file__
__spec__.loader
math.__dict__
math.__loader__
math.__spec__.loader.load_module('os')
xacro.__dict__
xacro.load_yaml.__globals__
xacro.load_yaml.__self__
xacro.load_yaml.__func__.__code__
xacro.load_yaml._call
xacro.load_yaml.name
xacro.os
xacro.sys
xacro.safe_eval('1')
xacro.eval_text('1')
xacro.message.__closure__
load_yaml.__code__
radians.__self__
len.__self__
'a'.join.__self__
'a'.join._call
'a'.join.call
dict.fromkeys(range(3))
dict.__init__
dict.__subclasses__()
str.maketrans('a', 'b')
str.mro()
'a'.encode()
'a'.translate(dict(a=1))
int.from_bytes
(1.5).hex()
dict(__class__=1)
dict(a=len)
[len]
str(len)
str(math)
xacro.dotify(dict(a=1)).__class__
xacro.dotify(dict(a=1)).__getattr__('a')
xacro.dotify(dict(a=1)).pop('a')
xacro.dotify(dict(a=1)).update
xacro.load_yaml('data.yaml').__class__
xacro.load_yaml('data.yaml').list.append(1)
xacro.load_yaml('data.yaml').list.__class__
xacro.tokenize('a' * 40 + '!', 'a](x+x+)+y[')
1 .__class__
b''.join
1j.imag
...
{1, 2}
import os
del x
yield 1
await x
*a
**a
x = 1
assert 1
""".strip().splitlines()

READING = r"""
xacro.load_yaml('/etc/passwd')
xacro.load_yaml('/proc/self/environ')
xacro.load_yaml('../secret.yaml')
xacro.load_yaml('inner/../../secret.yaml')
xacro.load_yaml('linked.yaml')
xacro.load_yaml('linked_folder/secret.yaml')
xacro.load_yaml('file:///etc/passwd')
xacro.load_yaml('~/.ssh/id_rsa')
xacro.load_yaml('\x00')
xacro.load_yaml('a' * 5000)
xacro.load_yaml('.')
xacro.load_yaml('pipe')
xacro.load_yaml(xacro.abs_filename('../secret.yaml'))
load_yaml('../secret.yaml')
list(map(xacro.load_yaml, ['../secret.yaml']))
xacro.load_yaml('run.yaml')
xacro.load_yaml('name.yaml')
xacro.load_yaml('new.yaml')
xacro.load_yaml('merge.yaml')
xacro.load_yaml('laughs.yaml')
xacro.load_yaml('endless.yaml')
xacro.load_yaml('deep.yaml')
xacro.load_yaml('unit.yaml')
xacro.load_yaml('binary.yaml')
xacro.load_yaml('number.yaml')
""".strip().splitlines()

YAML = {
    "data.yaml": "list: [1]\n",
    "run.yaml": "a: !!python/object/apply:os.system ['touch CANARY']\n",
    "name.yaml": "a: !!python/name:os.system\n",
    "new.yaml": "a: !!python/object/new:os.system ['touch CANARY']\n",
    "merge.yaml": "a: &a {x: 1}\nb:\n  <<: [*a, *a]\n",
    "laughs.yaml": "a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9]\n"
    + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "endless.yaml": "&a [*a]\n",
    "deep.yaml": "[" * 5000 + "]" * 5000,
    "unit.yaml": "a: !degrees ().__class__\n",
    "binary.yaml": "a: !!binary aGVsbG8=\n",
    "number.yaml": f"a: {'9' * 9000}\n",
}

ELEMENTS = {
    "include_up": '<xacro:include filename="../secret.xacro"/>',
    "include_around": '<xacro:include filename="inner/../../secret.xacro"/>',
    "include_absolute": '<xacro:include filename="/etc/passwd"/>',
    "include_link": '<xacro:include filename="linked.xacro"/>',
    "include_linked_folder": '<xacro:include filename="linked_folder/secret.xacro"/>',
    "include_optional": '<xacro:include filename="../secret.xacro" optional="true"/>',
    "include_pattern": '<xacro:include filename="../*.xacro"/>',
    "include_pattern_up": '<xacro:include filename="*/../../secret.xacro"/>',
    "include_pattern_link": '<xacro:include filename="linked_folder/*.xacro"/>',
    "include_pattern_far": '<xacro:include filename="/*/*/*"/>',
    "include_pattern_many": '<xacro:include filename="*/*/*/*/*/*.xacro"/>',
    "include_url": '<xacro:include filename="file:///etc/passwd"/>',
    "include_device": '<xacro:include filename="/dev/zero"/>',
    "include_pipe": '<xacro:include filename="pipe"/>',
    "include_expression": "<xacro:include filename=\"${'..' + '/secret.xacro'}\"/>",
    "include_argument": '<xacro:include filename="$(dirname)/../secret.xacro"/>',
    "include_cwd": '<xacro:include filename="$(cwd)/../secret.xacro"/>',
    "include_package": '<xacro:include filename="$(find boat)/../secret.xacro"/>',
    "find_up": '<a b="$(find ..)"/>',
    "find_root": '<a b="$(find /)"/>',
    "env": '<a b="$(env HARBOUR)"/>',
    "env_home": '<a b="$(env HOME)"/>',
    "env_eval": '<a b="${$(env HARBOUR)}"/>',
    "eval_import": '<a b="$(eval __import__)"/>',
    "eval_class": '<a b="$(eval ().__class__)"/>',
    "eval_fstring": "<a b=\"$(eval f'{[].__class__}')\"/>",
    "eval_set": '<a b="$(eval {1,2})"/>',
    "eval_of_env": '<a b="$(eval env)"/>',
    "eval_open": '<a b="$(eval open)"/>',
    "argument_code": '<xacro:arg name="c" default="().__class__"/><a b="${$(arg c)}"/>',
    "property_code": '<xacro:property name="c" value="${\'().__cl\' + \'ass__\'}"/><a b="${$(eval c)}"/>',
    "property_builtins": '<xacro:property name="__builtins__" value="1"/>',
    "property_class": '<xacro:property name="${\'__class__\'}" value="1"/>',
    "property_of_property": '<xacro:property name="a.__class__" value="1"/>',
    "namespace_class": '<xacro:include filename="good.xacro" ns="g"/><a b="${g.__class__}"/>',
    "namespace_parent": '<xacro:include filename="good.xacro" ns="g"/><a b="${g.parent}"/>',
    "namespace_root": '<xacro:include filename="good.xacro" ns="g"/><a b="${g.root}"/>',
    "namespace_itself": '<xacro:include filename="good.xacro" ns="g"/><a b="${g}"/>',
    "block_as_value": '<xacro:include filename="good.xacro" ns="g"/><xacro:property name="b"><c/></xacro:property>'
    "<a b=\"${g['**b']}\"/>",
    "macro_name": '<xacro:macro name="__init__.x" params="a"/>',
    "call_name": '<xacro:call macro="__class__"/>',
}

DOCTYPES = {
    "entities": '<!DOCTYPE a [<!ENTITY a "aa"><!ENTITY b "&a;&a;&a;">]><robot>&b;</robot>',
    "laughs": '<!DOCTYPE a [<!ENTITY l0 "ha">'
    + "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
    + "]><robot>&l9;</robot>",
    "external": '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot>&x;</robot>',
    "external_near": '<!DOCTYPE a [<!ENTITY x SYSTEM "../secret.xacro">]><robot>&x;</robot>',
    "parameter": '<!DOCTYPE a [<!ENTITY % x SYSTEM "file:///etc/passwd"> %x;]><robot/>',
    "dtd": '<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>',
    "public": '<!DOCTYPE robot PUBLIC "a" "http://127.0.0.1:9/a.dtd"><robot/>',
}


@pytest.fixture
def boat(tmp_path, monkeypatch):
    """A robot's folder with traps around it: a secret above, links to it, and one in the environment."""
    folder = tmp_path / "boat"
    (folder / "inner").mkdir(parents=True)
    (tmp_path / "secret.yaml").write_text(f"a: {SECRET}\n", encoding="utf-8")
    (tmp_path / "secret.xacro").write_text(f'<robot><link name="{SECRET}"/></robot>', encoding="utf-8")
    (folder / "linked.yaml").symlink_to(tmp_path / "secret.yaml")
    (folder / "linked.xacro").symlink_to(tmp_path / "secret.xacro")
    (folder / "linked_folder").symlink_to(tmp_path)
    (folder / "good.xacro").write_text(f'{HEAD}<xacro:property name="x" value="1"/></robot>', encoding="utf-8")
    for name, text in YAML.items():
        (folder / name).write_text(text.replace("CANARY", str(tmp_path / "canary")), encoding="utf-8")
    (folder / "package.xml").write_text("<package><name>boat</name></package>", encoding="utf-8")
    os.mkfifo(folder / "pipe")
    monkeypatch.setattr(expand_module, "_SECONDS", 1)  # for what takes for ever
    monkeypatch.setenv("HARBOUR", SECRET)
    monkeypatch.chdir(folder)
    return folder


def outcome(folder, text):
    """What a file expands to, or says; nothing of the secrets, and nothing was done."""
    (folder / "boat.xacro").write_text(text.replace("CANARY", str(folder.parent / "canary")), encoding="utf-8")
    try:
        said = expand(Path("boat.xacro"))
    except ConfigError as error:
        said = str(error)
        assert "\n" not in said
    assert SECRET not in said
    assert "root:" not in said
    assert not (folder.parent / "canary").exists()
    assert not (folder / "canary").exists()
    return said


def in_attribute(expression):
    text = expression.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    return f'{HEAD}<a b="${{{text}}}"/></robot>'


@pytest.mark.usefixtures("in_this_process")  # the language alone holds it
def test_python_is_out_of_reach(boat):
    for expression in PYTHON:
        outcome(boat, in_attribute(expression))


@pytest.mark.usefixtures("in_this_process")
def test_python_is_out_of_reach_of_substitutions(boat):
    for expression in PYTHON:
        escaped = expression.replace("&", "&amp;").replace("<", "&lt;")
        outcome(boat, f"{HEAD}<a>$(eval {escaped})</a></robot>")


@pytest.mark.usefixtures("in_this_process")
def test_python_is_out_of_reach_of_texts(boat):
    """Texts are evaluated as attributes are: a share of the expressions shows it."""
    macro = '<xacro:macro name="m" params="x:=1"><a/></xacro:macro>'
    for expression in PYTHON[::6]:
        escaped = expression.replace("&", "&amp;").replace("<", "&lt;")
        outcome(boat, f"{HEAD}{macro}<xacro:m>${{{escaped}}}</xacro:m></robot>")


@pytest.mark.parametrize("expression", READING)
def test_files_outside_and_yaml_that_runs_are_refused(expression, boat):
    outcome(boat, in_attribute(expression))


@pytest.mark.parametrize("name", ELEMENTS)
def test_elements_lead_nowhere(name, boat):
    outcome(boat, f"{HEAD}{ELEMENTS[name]}</robot>")


@pytest.mark.parametrize("name", DOCTYPES)
def test_document_types_and_entities_are_refused(name, boat):
    said = outcome(boat, DOCTYPES[name])
    assert said.endswith("<!DOCTYPE>: document types and entities are not allowed; remove them")
    (boat / "part.xacro").write_text(DOCTYPES[name], encoding="utf-8")
    assert outcome(boat, f'{HEAD}<xacro:include filename="part.xacro"/></robot>').startswith("part.xacro:1:")


def test_an_optional_environment_variable_is_its_default(boat):
    (boat / "boat.xacro").write_text(
        f'{HEAD}<a b="[$(optenv HARBOUR none at all)]"/><c d="$(optenv HARBOUR)"/></robot>'
    )
    text = expand(Path("boat.xacro"))
    assert '<a b="[none at all]"/>' in text
    assert '<c d=""/>' in text


def test_the_traps_work(boat, monkeypatch):
    """The xacro package by itself walks into them, so the tests above can fail."""
    for text in (ELEMENTS["include_up"], ELEMENTS["include_link"], in_attribute(READING[2]), ELEMENTS["env"]):
        body = text if text.startswith("<robot") else f"{HEAD}{text}</robot>"
        (boat / "boat.xacro").write_text(body, encoding="utf-8")
        assert SECRET in xacro.process_file("boat.xacro").toxml()
