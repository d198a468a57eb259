"""Other people's files: readers that turn them into documents of `config`, found by suffix."""

from vrx_mj.config.kinds import Reader
from vrx_mj.config.search import MODEL_SUFFIXES, SCHEME, WORLD_SUFFIXES, XML_SUFFIXES

__all__ = ["READERS"]

MODELS = (*MODEL_SUFFIXES, SCHEME)
READERS = (
    Reader("sources", ("",), "gazebo.opening:open_source"),
    Reader("worlds", WORLD_SUFFIXES, "gazebo.worlds:world_document"),
    Reader("worlds", ("#",), "series.worlds:world_document"),
    Reader("names", ("",), "gazebo.launched:world_message"),
    Reader("series", (".yaml", ".yml"), "series.worlds:refuse_axes"),
    Reader("fleets", (".launch", ".launch.py"), "gazebo.opening:launch_document"),
    Reader("fleets", (*XML_SUFFIXES, *MODELS), "gazebo.opening:fleet_document"),
    Reader("fleets", ("/",), "gazebo.opening:folder_document"),
    Reader("objects", MODELS, "gazebo.sdf_objects:object_document", find="gazebo.models:model_file"),
    Reader("robots", MODELS, find="gazebo.models:model_file"),
    Reader("robots", ("/",), find="gazebo.models:file_in_folder"),
    Reader("parts", ("",), "parts.read:load_parts"),
    Reader("meshes", ("",), "urdf.reader:read_mesh"),
)
"""The first that claims a path has it."""
