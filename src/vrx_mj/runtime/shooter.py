"""Ball shooters: a shot puts the shooter's ball to the muzzle and gives it a velocity, as VRX's plugin does."""

from vrx_mj.arguments import check_name
from vrx_mj.errors import CommandError, SensorError
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.sensing import Sensing
from vrx_mj.runtime.weather import Sea
from vrx_mj.sensors.places import Mount

__all__ = ["fire"]


def fire(sensing: Sensing, rig: LoopArrays, sea: Sea, boat: str, name: str | None) -> bool:
    """Shoot; tells whether there was a shot left. The recoil on the boat is neglected, as in VRX.

    Raises:
        UnknownNameError: no such boat, or no such shooter on it.
        CommandError: the boat has no shooter, or several and none is named.
        SensorError: the world has no ball for it.
    """
    sensor = _chosen(sensing.of_kind(boat, "ball_shooter"), boat, name)
    if sensor.ball is None:
        raise SensorError(f"{sensor.name} of {boat} has no ball: the world was compiled without one")
    shots = rig.sample_clocks.device_state[sensor.marks]
    if shots[0] < 1.0:
        return False
    shots[0] -= 1.0
    _launch(rig, sea, sensor, inherits=sensing.inherits)
    return True


def _launch(rig: LoopArrays, sea: Sea, sensor: Mounted, *, inherits: bool) -> None:
    """Put the ball to the muzzle, with the launcher's axes, and let it go along their x.

    It starts with the speed that gravity takes in half a step more: a step takes gravity off before it moves, and so
    its places are those of the parabola.
    """
    assert sensor.ball is not None, f"{sensor.name} has no ball"
    data, ball, mount = rig.data, rig.floats[sensor.ball], sensor.mount
    muzzle = Mount(mount.position + mount.rotation @ sensor.config.muzzle, mount.rotation, mount.orientation)
    place = sensor.place(data.qpos, data.qvel, muzzle)
    velocity = place.rotation[:, 0] * (sensor.config.impulse / float(ball["mass"]))
    if inherits:
        velocity += place.velocity
    velocity -= 0.5 * rig.timestep * rig.model.opt.gravity
    qpos, dof = int(ball["qpos"]), int(ball["dof"])
    data.qpos[qpos : qpos + 3], data.qpos[qpos + 3 : qpos + 7] = place.position, place.orientation
    data.qvel[dof : dof + 3], data.qvel[dof + 3 : dof + 6] = velocity, 0.0
    rig.set_afloat(sensor.ball, float(sea.height(place.position[0], place.position[1], data.time)))


def _chosen(shooters: dict[str, Mounted], boat: str, name: str | None) -> Mounted:
    if not shooters:
        raise CommandError(f"{boat} has no ball shooter")
    if name is None and len(shooters) > 1:
        raise CommandError(f"{boat} has {len(shooters)} ball shooters: name one of {', '.join(shooters)}")
    chosen = next(iter(shooters)) if name is None else name
    check_name(f"ball shooter of {boat}", chosen, shooters)
    return shooters[chosen]
