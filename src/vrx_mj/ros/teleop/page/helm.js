// Keys, what they ask of a boat, and its engines: the same as vrx_mj.drive.pilot, which a test holds it to.

const SHORT_ARM = 0.1; // [m]
const FULL_RUDDER = 0.5; // [rad]
const STEP = 0.1;
const TWISTS = { i: [1, 0], ",": [-1, 0], j: [0, 1], l: [0, -1], u: [1, 1], o: [1, -1], m: [-1, -1], ".": [-1, 1] };
const NUDGES = { up: [STEP, 0], down: [-STEP, 0], left: [0, STEP], right: [0, -STEP] };
const SCALES = {
  q: [["speed", "turn"], 1.1], z: [["speed", "turn"], 0.9], w: [["speed"], 1.1], x: [["speed"], 0.9],
  e: [["turn"], 1.1], c: [["turn"], 0.9], r: [["angle"], 1.1], v: [["angle"], 0.9],
};
const NAMES = {
  ArrowUp: "up", ArrowDown: "down", ArrowLeft: "left", ArrowRight: "right", " ": "space", Backspace: "backspace",
};

export const REST = Object.freeze({ power: 0, turn: 0, angle: 0 });
export const isRest = (wheel) => wheel.power === 0 && wheel.turn === 0 && wheel.angle === 0;
export const keyName = (event) => NAMES[event.key] ?? event.key.toLowerCase();

const within = (value, limit) => Math.min(Math.max(value, -limit), limit);
const sign = (value) => (value < 0 || Object.is(value, -0) ? -1 : 1);
const share = (value) => Math.round(within(value, 1) * 1e6) / 1e6;

// Commands of engines: thrusts by name, steering angles by name with `_angle`.
export function engineCommands(engines, wheel) {
  const reach = Math.max(0, ...engines.map((engine) => Math.abs(engine.arm)));
  const commands = {};
  for (const engine of engines) {
    const byAngle = engine.rudder || reach <= SHORT_ARM;
    if (!engine.rudder) {
      const turn = byAngle ? 0 : (wheel.turn * engine.arm) / reach;
      const thrust = within(sign(engine.forward) * wheel.power + turn, 1);
      commands[engine.name] = thrust * (thrust > 0 ? engine.ahead : engine.astern);
    }
    if (engine.max_angle > 0) {
      const steer = byAngle ? (engine.aft ? -FULL_RUDDER : FULL_RUDDER) * wheel.turn : 0;
      commands[`${engine.name}_angle`] = within(steer + wheel.angle, engine.max_angle);
    }
  }
  return commands;
}

// Drives one boat at a time; boats that were driven once keep their last command.
export class Pilot {
  constructor() {
    this.engines = {};
    this.boat = "";
    this.sizes = { speed: 0.5, turn: 1.0, angle: 0.1 };
    this.wheels = {};
  }

  get boats() {
    return Object.keys(this.engines);
  }

  get wheel() {
    return this.wheels[this.boat] ?? REST;
  }

  get maxAngle() {
    return Math.max(0, ...(this.engines[this.boat] ?? []).map((engine) => engine.max_angle));
  }

  meet(engines) {
    this.engines = engines;
    for (const boat of Object.keys(this.wheels)) if (!(boat in engines)) delete this.wheels[boat];
    if (!(this.boat in engines)) this.boat = this.boats[0] ?? "";
  }

  set(change) {
    if (this.boat) this.wheels[this.boat] = { ...this.wheel, ...change };
  }

  reset() {
    this.wheels = {};
  }

  // Whether the key means anything here.
  press(key) {
    if (!this.boat) return false;
    if (key in NUDGES) {
      const [power, turn] = NUDGES[key];
      this.set({ power: share(this.wheel.power + power), turn: share(this.wheel.turn + turn) });
    } else if (key in TWISTS) {
      const [power, turn] = TWISTS[key];
      this.set({ power: power * this.sizes.speed, turn: turn * this.sizes.turn });
    } else if (key === "h" || key === ";") {
      const step = this.sizes.angle * (key === ";" ? 1 : -1);
      this.set({ angle: within(this.wheel.angle + step, this.maxAngle) });
    } else if (key === "space" || key === "k") this.set({ power: 0, turn: 0 });
    else if (key in SCALES) for (const name of SCALES[key][0]) this.sizes[name] *= SCALES[key][1];
    else if (key === "n") this.boat = this.boats[(this.boats.indexOf(this.boat) + 1) % this.boats.length];
    else if (/^[1-9]$/.test(key) && this.boats[key - 1]) this.boat = this.boats[key - 1];
    else return false;
    return true;
  }
}

// A boat's URDF for another name: its namespace is renamed, paths of files that have the same word in them are not.
export function renamed(urdf, from, to) {
  return urdf.replace(new RegExp(`(?<=["'>\\s]/?)${from}(?=["'<\\s/])`, "g"), to);
}

// The first of wamv2, wamv3, ... that nothing has.
export function freeName(name, taken) {
  const stem = name.replace(/\d+$/, "");
  let number = 2;
  while (taken.includes(stem + number)) number++;
  return stem + number;
}

// The nearest place around a boat, abeam at best, that is water and as far from each [x, y, distance] as that says.
export function freeSpot(boat, taken, isLand) {
  for (let away = 8; away <= 64; away += 8) {
    for (const side of [90, -90, 45, -45, 135, -135, 0, 180]) {
      const turn = boat.yaw + (side * Math.PI) / 180;
      const [x, y] = [boat.x + away * Math.cos(turn), boat.y + away * Math.sin(turn)];
      if (!isLand(x, y) && taken.every(([a, b, room]) => Math.hypot(a - x, b - y) >= room)) return { x, y };
    }
  }
  return null;
}
