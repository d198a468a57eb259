"""Objects of the catalogue, and users' own, as pieces of one body each."""

from vrx_mj.config.objects import ObjectConfig
from vrx_mj.mjcf.pieces import Piece
from vrx_mj.mjcf.templates import geoms, meshes

__all__ = ["object_piece"]


def object_piece(config: ObjectConfig, *, asleep: bool = False) -> Piece:
    """One floating or static object; asleep, it takes no part in a step until its pose is changed.

    The body carries the name of the object's link. Collision geoms are in group 3, visual ones, which neither
    collide nor weigh, in group 2. Mass, centre of mass and inertia are the configuration's, never the geoms'.
    """
    needed = meshes([*config.collisions, *config.visuals])
    values = {
        "object": config,
        "meshes": needed,
        "solid_meshes": meshes(config.collisions),
        "collisions": geoms(config.collisions),
        "visuals": geoms(config.visuals),
        "asleep": asleep,
    }
    return Piece("object.xml.j2", values, {item.file: item.content for item in needed})
