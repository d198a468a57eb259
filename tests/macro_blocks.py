"""What the blocks of the macros of VRX's worlds may hold."""

__all__ = ["BLOCKS"]

BLOCKS = {
    "wind_objs": "<wind_obj><name>wamv</name><link_name>wamv/base_link</link_name>"
    "<coeff_vector>.5 .5 .33</coeff_vector></wind_obj>",
    "fog": "<fog><type>linear</type><density>0.1</density></fog>",
    "ambient": "0.3 0.3 0.3 1",
    "wp_markers": "<markers><height>2</height></markers>",
    "waypoints": "<waypoint><pose>-33.7226 150.674 1</pose></waypoint>",
    "gates": "<gate><left_marker>red_bound_0</left_marker><right_marker>green_bound_0</right_marker></gate>",
    "model_includes": "<include><name>red_0</name><uri>model://surmark950410</uri></include>",
    "object_sequence": "<object><time>1</time><type>red</type><name>red_0</name><pose>6 0 0 0 0 0</pose></object>",
    "animal_includes": "<include><name>turtle</name><uri>model://turtle_buoy</uri></include>",
    "animal_buoys": "<buoy><model_name>turtle</model_name><goal>avoid</goal></buoy>",
}
