import math

from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString

from vrx_mj.campaign.results import MOST, TOLERANCE, Tracks, simplified

ROUNDING = 0.05 * math.sqrt(2.0)  # to a decimetre, both ways [m]


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=2, max_size=60))
def test_a_simplified_track_stays_near_and_keeps_its_ends(places):
    line = simplified(places)
    assert LineString(places).hausdorff_distance(LineString(line)) <= TOLERANCE + ROUNDING + 1e-6
    assert all(math.dist(line[end], places[end]) <= ROUNDING + 1e-9 for end in (0, -1))


def test_a_straight_way_needs_two_points():
    tracks = Tracks()
    for i in range(1000):
        tracks.add("wamv", (0.1 * i, 0.05 * i, 0.0))
    assert len(tracks.simplified()["wamv"]) == 2


def test_a_long_curly_way_keeps_few_points():
    places = [(i * math.cos(i), i * math.sin(i)) for i in range(5000)]
    assert len(simplified(places)) <= MOST
