"""The models that step: a world without visuals, and its contact-free twin, which steps while nothing can touch."""

import mujoco

from vrx_mj.errors import CompileError
from vrx_mj.mjcf.pieces import Detail, Pieces
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.crowding import arena_bytes, row_arena_bytes

_DETAILS = (Detail.WITHOUT_VISUALS, Detail.CONTACT_FREE)


def stepping_models(world: World) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model that steps, without anything that is only seen, and its contact-free twin, which has no shapes.

    The twin steps the same data while nothing can touch anything. The models have the memory for contacts that their
    shapes can need (`row_arena_bytes`): thousands of rows may have data of them.

    Raises:
        CompileError: MuJoCo cannot compile the saved world.
    """
    return PhysicsModels(roomy=False).models(world)


class PhysicsModels:
    """The stepping models of a world, and of those that it becomes as boats come and go.

    The specs are kept: attaching a boat to them is faster than reading all the rest again. Deleting one is not.
    """

    def __init__(self, *, roomy: bool = True) -> None:
        """`roomy`: whether there is memory for heaps of what was placed, as a `Simulation` has it but no row."""
        self._roomy = roomy
        self._kept: tuple[Pieces, list[mujoco.MjSpec]] | None = None

    def models(self, world: World) -> tuple[mujoco.MjModel, mujoco.MjModel]:
        """The models of `stepping_models`, sooner if the world only has something more than the one before.

        Raises:
            CompileError: MuJoCo cannot compile the saved world.
        """
        try:
            specs = self._specs(world.pieces)
            collision, contact_free = (self._compile(spec, len(world.pieces.parts)) for spec in specs)
        except ValueError as error:
            raise CompileError(f"MuJoCo cannot compile the saved world {world.name}: {error}") from error
        self._kept = world.pieces, specs
        return collision, contact_free

    def _specs(self, pieces: Pieces) -> list[mujoco.MjSpec]:
        kept, self._kept = self._kept, None
        if kept and all(
            pieces.grow_spec(spec, kept[0], detail) for spec, detail in zip(kept[1], _DETAILS, strict=True)
        ):
            return kept[1]
        return [pieces.spec(detail) for detail in _DETAILS]

    def _compile(self, spec: mujoco.MjSpec, parts: int) -> mujoco.MjModel:
        spec.memory = arena_bytes(parts) if self._roomy else -1
        if not self._roomy:
            spec.memory = row_arena_bytes(spec.compile())
        return spec.compile()
