"""What happens in a run besides sailing: touches, boats that come and go, states, rows of batches, as it was before."""

import math

import numpy as np

import vrx_mj
from fingerprints import check
from integration.jointed import PENDULUM, RAFT, simulation_of
from integration.test_fingerprints_recordings import BOATS, WINDY, world_of
from integration.test_fingerprints_worlds import arrays_of, compiled


class Run:
    """A simulation, of which all is looked at from time to time."""

    def __init__(self, name, sim):
        self.name, self.sim, self.moments, self.told = name, sim, 0, []
        sim.attach(self, rate=20.0)
        sim.watch_contacts(self.told.append)
        self.ended = sim.watch_contacts(self.told.append, ended=True)

    def rows(self, block):
        self.told.append(block.copy())

    def state(self, time, blob):
        self.told.append([time, len(blob)])

    def event(self, time, text, level):
        self.told.append([time, level])

    def frame(self, time, row, messages):
        self.told.append([time, row.copy()])

    def boats_changed(self):
        self.told.append(len(self.sim.boats))

    def go(self, steps):
        self.sim.advance(steps)
        self.look()

    def look(self):
        """Compare all there is with what it was."""
        sim = self.sim
        state = sim.get_state()
        seen = [[sim.thrust(one), sim.steering(one), sim.forces(one)] for one in sim.boats]
        check(
            "runtime", f"{self.name} {self.moments}", **arrays_of(sim), told=self.told, features=sim.features,
            saved=[state.time, state.mujoco, state.moving], boats=seen, task=sim.task,
        )  # fmt: skip
        self.told.clear()
        self.moments += 1


def test_boats_that_touch_come_and_go_do_as_before(monkeypatch):
    monkeypatch.setattr("vrx_mj.runtime.running_world._DRAIN_PERIOD", math.inf)  # of wall time
    sim = vrx_mj.Simulation(world_of("pond"), seed=4)
    run = Run("pond", sim)
    run.look()
    for number, boat in enumerate(sim.boats):
        sim.command_all({boat: dict.fromkeys(sim.command_names(boat), 0.4 + 0.3 * number)})
    shown = [sim.showing(name) for name in (*sim.lights, *sim.placards)]
    run.go(120)
    for light in sim.lights:
        sim.set_light(light, ("red", "blue", "green"))
    for placard in sim.placards[:2]:
        sim.set_placard(placard, "blue_cross")
    for name in (*sim.lights, *sim.placards[1:]):
        sim.shuffle(name)
    shown += [sim.showing(name) for name in (*sim.lights, *sim.placards)]
    check("runtime", "lights and placards", shown=shown)
    sim.set_boat("b", pose=(*np.add(sim.observe()["a"].position, (0.3, 2.2, 0.0)), 0.0, 0.0, 0.1))
    run.go(70)
    sim.set_boat("b", pose=(0.0, 60.0, 0.0, 0.0, 0.0, 0.0), velocity=(1.0, 0.5, 0.0, 0.0, 0.0, 0.2))
    run.go(130)
    sim.spawn("c", pose=(30, -20, 0, 0, 0, 1.0), sensors="none")
    run.go(30)
    sim.remove("b")
    run.go(30)
    sim.detach(run)
    sim.remove("c")
    sim.reset(9)
    run.go(30)


def test_joints_go_on_as_before(tmp_path):
    things = {"raft": (RAFT, (0, 0, 0, 0, 0, 0)), "arm": (PENDULUM, (6, 0, 0, 0, 0.3, 0))}
    sim = simulation_of(tmp_path, sea=WINDY["sea"], **things)
    run = Run("joints", sim)
    run.go(60)
    sim.detach(run)
    kept = sim.get_state()
    sim.set_object("raft", pose=(-3.0, 1.0, 0.2, 0.1, 0.0, 0.4), velocity=(0.5, 0.0, 0.0, 0.0, 0.0, 0.3))
    run.go(60)
    sim.set_state(kept)
    run.go(30)


def test_rows_of_a_batch_go_on_as_before():
    pair = {"boats": [{**boat, "robot": "blueboat"} for boat in BOATS["boats"]]}
    marine = compiled(WINDY | {"physics": {"profile": "marine"}}, fleet=pair)
    for name, world in (("marine", marine), ("vrx", world_of("windy"))):
        batch = vrx_mj.Batch(world, 4, seed=2, threads=1)
        given = np.linspace(-0.4, 0.9, batch.n)[:, None] * np.linspace(1.0, 0.5, len(batch.channels))
        batch.vary(rows=[1], waves=0.7)
        batch.vary(rows=[2], parameters={"wind.mean": 3.0, "sea.level": 0.2})
        moments = []
        for moment in range(5):
            batch.step(given, duration=0.3)
            if moment == 1:
                batch.set_boat("b", pose=(*batch.qpos[3, :3] + (0.3, 2.2, 0.0), 0.0, 0.0, 0.1), rows=[3])
            elif moment == 2:
                batch.reset([0], seed=11)
                batch.command(0.5 * given)
                batch.advance(20)
            states = [batch.get_state(row) for row in range(batch.n)]
            moments.append([batch.time, batch.features, batch.wind, batch.seeds, batch.diverged, batch.largest,
                            batch.largest_masses, *([one.mujoco, one.moving, one.varied] for one in states),
                            batch.sea_height(np.ones((4, 1)), np.zeros((4, 1)))])  # fmt: skip
        afloat = batch.afloat("a", [[0.0, 0.0, 0.3], [5.0, -3.0, 1.0]], rows=[1, 2])
        check("runtime", f"batch, {name}", moments=moments, afloat=afloat, waves=[batch.waves(row) for row in range(4)])
        if name == "marine":
            check("runtime", "batch: energy", energy=[batch.energy(boat) for boat in batch.boats])


def test_a_run_is_summed_up_as_before():
    sim = vrx_mj.Simulation(world_of("pond"), seed=4)
    beside = (*np.add(sim.observe()["a"].position, (0.3, 2.2, 0.0)), 0.0, 0.0, 0.1)

    def controller(observations, time):
        if time == 0.0:
            sim.set_boat("b", pose=beside, velocity=(0.0, -1.0, 0.0, 0.0, 0.0, 0.0))
        return {boat: dict.fromkeys(sim.command_names(boat), 0.1 + time) for boat in observations}

    found = vrx_mj.run(sim, 0.8, controller=controller).as_dict()
    for machine in ("wall_time", "real_time_factor", "state_sha256", "physics_version", "platform"):
        del found[machine]
    check("runtime", "run", **found)


def test_weather_is_asked_for_as_before():
    """All over the place and at times before and after that of the run."""
    sim = vrx_mj.Simulation(world_of("windy"), seed=4)
    random = np.random.default_rng(1)
    x, y, t = random.uniform((-50.0, -50.0, 0.0), (50.0, 50.0, 30.0), (8, 3)).T
    for steps in (0, 150):
        sim.advance(steps)
        gusts = sim.wind.velocity(t), sim.wind.velocity(t[:, None], [0.5, 10.0, 40.0])
        water = [ask(x, y, t) for ask in (sim.sea.height, sim.sea.slope)]
        water += [ask(x, y, -x / 90.0 - 0.6, t) for ask in (sim.sea.velocity, sim.sea.acceleration, sim.sea.pressure)]
        check("runtime", f"weather, {steps}", wind=[sim.wind.speed, sim.wind.direction, gusts], sea=water)
