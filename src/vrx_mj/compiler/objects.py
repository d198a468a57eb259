"""Objects of the catalogue, and users' own, as MuJoCo models of one body each."""

from vrx_mj.compiler.templates import geoms, meshes, render
from vrx_mj.config.objects import ObjectConfig

__all__ = ["object_mjcf"]


def object_mjcf(config: ObjectConfig) -> tuple[str, dict[str, bytes]]:
    """MJCF of one floating or static object, and the contents of the mesh files that it names.

    The body carries the name of the object's link. Collision geoms are in group 3, visual ones, which neither
    collide nor weigh, in group 2. Mass, centre of mass and inertia are the configuration's, never the geoms'.
    """
    needed = meshes([*config.collisions, *config.visuals])
    text = render(
        "object.xml.j2",
        object=config,
        meshes=needed,
        collisions=geoms(config.collisions),
        visuals=geoms(config.visuals),
    )
    return text, {item.file: item.content for item in needed}
