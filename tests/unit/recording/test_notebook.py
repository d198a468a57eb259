"""What notebooks show, without one; a real kernel runs the example in tests/integration/test_notebook.py."""

import math
import re
import shutil
import sys
from types import ModuleType, SimpleNamespace

import pytest

import vrx_mj
from vrx_mj.draw.course import map_of
from vrx_mj.draw.map import draw_map
from vrx_mj.errors import CommandError, RecordError, VrxError
from vrx_mj.packages import install_extra
from vrx_mj.recording import notebook


@pytest.fixture(scope="module")
def sim():
    return vrx_mj.Simulation(vrx_mj.compile_world("ocean_buoys", fleet="trio"))


@pytest.fixture
def shell(monkeypatch):
    """IPython's own formatters, as `register` finds them in a kernel."""
    import IPython
    from IPython.core import formatters

    own = SimpleNamespace(display_formatter=formatters.DisplayFormatter(), kernel=object())
    monkeypatch.setattr(IPython, "get_ipython", lambda: own)
    return own


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("notebook") / "run.rrd"
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
    with vrx_mj.record(sim, path, sea=False):
        sim.step(duration=0.5)
    return path


def test_worlds_are_maps_and_simulations_tables(shell, sim, tmp_path):
    notebook.register()
    shown, _ = shell.display_formatter.format(sim.world)
    assert set(shown) == {"text/plain", "image/png"}
    draw_map(map_of(sim.world), tmp_path / "map.png", (1000, 720))
    assert shown["image/png"] == (tmp_path / "map.png").read_bytes()
    assert shown["text/plain"] == "<World ocean_buoys, fleet trio, 3 boats, seed 0>"
    shown, _ = shell.display_formatter.format(sim)
    assert set(shown) == {"text/plain", "text/html"}
    assert shown["text/plain"] == f"ocean_buoys at t = {sim.time:g} s, seed 0"


def test_without_a_shell_there_is_nothing_to_register(monkeypatch):
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))
    notebook.register()
    monkeypatch.delitem(sys.modules, "IPython")
    notebook.register()
    assert not notebook.in_notebook()


def test_the_table_tells_where_every_boat_is(sim):
    sim.set_boat("wamv2", pose=(12.5, -7.25, 0.5, 0, 0, 3.141592653589793 / 2), velocity=(3, 4, 0, 0, 0, 0))
    rows = re.findall(r"<tr><td>(.*?)</td></tr>", notebook.simulation_table(sim))
    assert [row.split("</td><td>")[0] for row in rows] == list(sim.boats)
    assert rows[1].split("</td><td>") == ["wamv2", "12.50", "-7.25", "0.50", "90.0", "0.0", "306.9", "5.00"]


def test_a_task_stands_in_the_line():
    task = {"name": "gates", "state": "running", "score": 1.25}
    sim = SimpleNamespace(world=SimpleNamespace(name="bay"), time=12.5, seed=7, task=task)
    assert notebook.simulation_line(sim) == "bay at t = 12.5 s, seed 7; gates is running, score 1.25"


def viewer_of(monkeypatch):
    """Stands for rerun_notebook, and keeps what its viewers are sent."""

    class Viewer:
        def __init__(self, **size):
            self.size, self.sent = size, []

        def send_rrd(self, data):
            self.sent.append(data)

    module = ModuleType("rerun_notebook")
    module.Viewer = Viewer
    monkeypatch.setitem(sys.modules, "rerun_notebook", module)


def test_a_shown_recording_is_sent_whole(shell, recording, monkeypatch):
    viewer_of(monkeypatch)
    viewer = vrx_mj.show(recording, height=300)
    assert viewer.sent == [recording.read_bytes()]
    assert viewer.size == {"width": "auto", "height": 300}


def test_a_recording_of_a_killed_run_is_encoded_for_the_viewer(shell, tmp_path, monkeypatch):
    viewer_of(monkeypatch)
    monkeypatch.setattr("vrx_mj.recording.parts.FLUSH", 0.0)
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
    killed, shown = tmp_path / "killed.rrd", tmp_path / "shown.rrd"
    with vrx_mj.record(sim, tmp_path / "run.rrd") as writer:
        sim.step(duration=0.5)
        shutil.copy(writer.path, killed)
    shown.write_bytes(vrx_mj.show(killed).sent[0])
    assert vrx_mj.read_record(shown).has_views


def test_what_cannot_be_shown_is_told(shell, recording, monkeypatch):
    with pytest.raises(RecordError, match=r"^no recording 'none\.rrd'$"):
        vrx_mj.show("none.rrd")
    monkeypatch.setitem(sys.modules, "rerun_notebook", None)
    with pytest.raises(VrxError) as told:
        vrx_mj.show(recording)
    advice = install_extra("notebook")
    assert str(told.value) == f"no module 'rerun_notebook' to show '{recording}'; {advice}"
    shell.kernel = None
    with pytest.raises(VrxError) as told:
        vrx_mj.show(recording)
    assert str(told.value) == (f"show('{recording}') needs a notebook; elsewhere run: vrx-mj replay {recording}")


@pytest.fixture
def drawn(shell, monkeypatch):
    """What the notebook's bar looked like, drawing after drawing."""
    pictures = []
    from IPython import display

    def begin(picture, *, display_id):
        assert display_id is True
        pictures.append(picture.data)
        return SimpleNamespace(update=lambda later: pictures.append(later.data))

    monkeypatch.setattr(display, "display", begin)
    return pictures


def test_a_bar_in_a_notebook_ends_where_the_run_ended(drawn, sim, monkeypatch):
    monkeypatch.setattr(notebook, "REDRAW_PERIOD", 0.0)
    with vrx_mj.progress(sim, 4.0) as tick:
        tick(1.0)
        tick(3.0)
    assert drawn == [
        f'<progress value="{reached}" max="4"></progress> sailing, {reached} of 4 s' for reached in (0, 1, 3, 3)
    ]


def test_a_bar_in_a_notebook_is_not_redrawn_at_every_call_but_at_the_end(drawn, sim, monkeypatch):
    monkeypatch.setattr(notebook, "REDRAW_PERIOD", 3600.0)

    def fail():
        with vrx_mj.progress(sim, 100.0) as tick:
            for second in range(100):
                tick(float(second))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [re.search(r"value=\"(\d+)", picture).group(1) for picture in drawn] == ["0", "99"]


def test_the_referee_is_heard_under_the_bar(drawn):
    events = ((10.0, "a < b: ready", "INFO"),)
    task = {"name": "course", "state": "ready", "score": 0.0}
    with notebook.notebook_bar(SimpleNamespace(task=task, task_events=events), 20.0) as tick:
        tick(12.0)
        tick(13.0)
    assert drawn[-1] == (
        '<progress value="13" max="20"></progress> course: ready, no score yet, 13 of 20 s'
        "<pre>   10.00 s  a &lt; b: ready</pre>"
    )


def test_elsewhere_there_is_no_bar(sim, capsys):
    with vrx_mj.progress(sim) as tick:
        tick(30.0)
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "")


@pytest.mark.parametrize("duration", [0.0, -1.0, math.inf, math.nan])
def test_a_bar_is_of_some_time(sim, duration):
    with pytest.raises(CommandError, match=r"a number of seconds above 0 is needed$"):
        vrx_mj.progress(sim, duration)
