"""Parameters that clients of rosbridge set beside the simulation's own."""

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros.rosbridge.parameters import Parameters


@pytest.fixture
def parameters():
    found = Parameters()
    found.offer({"/sim": {"rate": 10, "name": "bay"}, "/use_sim_time": True})
    return found


def test_a_namespace_is_a_mapping_of_what_is_in_it(parameters):
    assert parameters.get("/sim") == {"rate": 10, "name": "bay"}
    assert parameters.get("/sim/rate") == 10
    assert parameters.names() == ["/sim/name", "/sim/rate", "/use_sim_time"]
    assert parameters.has("/sim")
    assert not parameters.has("/si")


def test_a_value_gives_way_to_a_namespace_of_its_name_and_the_other_way_round(parameters):
    parameters.set("/mine", 2)
    parameters.set("/mine/deep", {"er": 3})
    assert parameters.get("/mine") == {"deep": {"er": 3}}
    assert "/mine" not in parameters.names()
    parameters.set("/mine", 4)
    assert parameters.get("/mine") == 4
    assert [name for name in parameters.names() if "mine" in name] == ["/mine"]


def test_what_clients_set_can_go_but_not_the_simulation_s_own(parameters):
    parameters.set("/sim/rate", 20)
    assert parameters.get("/sim/rate") == 20
    parameters.delete("/sim/rate")
    assert parameters.get("/sim/rate") == 10
    for name in ("/sim/rate", "/nothing"):
        with pytest.raises(CommandError):
            parameters.delete(name)


def test_a_search_goes_from_the_inner_namespace_outwards(parameters):
    parameters.set("/a/b/gain", 1)
    parameters.set("/a/gain", 2)
    assert parameters.search("gain", "/a/b/c") == "/a/b/gain"
    assert parameters.search("gain", "/a") == "/a/gain"
    assert parameters.search("use_sim_time", "/a/b") == "/use_sim_time"
    assert parameters.search("none", "/a/b") is None
