// The page: what comes from the rosbridge goes to the map and the cards, what people do goes back.

import { Bridge } from "/bridge.js";
import { Chart } from "/chart.js";
import { engineCommands, freeName, freeSpot, isRest, keyName, Pilot, renamed, REST } from "/helm.js";
import { compass, notice, signed } from "/words.js";

const PERIOD = 100; // between two commands of a boat: VRX forgets them after a second [ms]
const STILL = 700; // after which a clock that says nothing stands [ms]
const SETTLES = 1000; // after which the clock shows a pause, or its end [ms]
const TWIST = "geometry_msgs/Twist";
const FULL = { power: 3, turn: 0.6 }; // of the joystick where cmd_vel is a velocity [m/s, rad/s]
const APART = 7; // of a boat that joins from everything else, at least [m]

const $ = (id) => document.getElementById(id);
const show = (id, text) => { if ($(id).textContent !== text) $(id).textContent = text; };
const degrees = (angle) => (angle * 180) / Math.PI;
const fromEast = () => world?.x_from_east ?? 0; // direction of the world's x axis [rad], counter-clockwise

const pilot = new Pilot();
const sent = {}; // the last command of each boat
const wind = { speed: null, direction: null };
let asked = -Infinity; // when this page paused or resumed last [ms]
let last = null; // the boat that was removed last
let world = null, boats = [], paused = false, ticked = 0, time = null, looked = null, isStickHeld = false, bridge;

const chart = new Chart($("map"), { chosen: choose, changed: showView });

// What comes from the world

function listen() {
  bridge.subscribe("/vrx_mj/world", "std_msgs/String", 0, ({ data }) => {
    world = JSON.parse(data);
    chart.setGround(world);
    paint();
    ask();
  });
  bridge.subscribe("/clock", "rosgraph_msgs/Clock", 100, ({ clock }) => {
    const now = clock.secs + clock.nsecs * 1e-9;
    if (time !== null && now < time) chart.clearTracks();
    time = now;
    ticked = performance.now();
    if (ticked - asked > SETTLES) setPaused(false);
  });
  bridge.subscribe("/gazebo/model_states", "gazebo_msgs/ModelStates", 80, see);
  bridge.subscribe("/gazebo/performance_metrics", "gazebo_msgs/PerformanceMetrics", 500, ({ real_time_factor }) =>
    show("pace", paused ? "–" : `${real_time_factor.toFixed(2)}×`));
  bridge.subscribe("/vrx/debug/wind/speed", "std_msgs/Float64", 250, ({ data }) => { wind.speed = data; });
  bridge.subscribe("/vrx/debug/wind/direction", "std_msgs/Float64", 250, ({ data }) => { wind.direction = data; });
  bridge.subscribe("/vrx/task/info", "vrx_gazebo/Task", 250, showTask);
}

function see({ name, pose, twist }) {
  name.forEach((one, index) => {
    const { x, y } = pose[index].position;
    if (boats.includes(one)) put(one, pose[index], twist[index]);
    else chart.things.set(one, [x, y]);
  });
  chart.redraw();
}

function put(name, { position, orientation: q }, { linear }) {
  const yaw = Math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z));
  chart.place(name, position.x, position.y, yaw, Math.hypot(linear.x, linear.y));
  chart.boats.get(name).z = position.z;
  chart.boats.get(name).course = Math.atan2(linear.y, linear.x);
}

// Which boats there are; and where, if time stands and nothing is published.
async function ask() {
  if (!bridge.isOpen) return;
  try {
    const { topics } = await bridge.call("/rosapi/topics_for_type", { type: TWIST });
    const names = topics.map((topic) => /^\/(.+)\/cmd_vel$/.exec(topic)?.[1]).filter(Boolean);
    meet(names.sort((a, b) => a.localeCompare(b, "en", { numeric: true })));
    if (performance.now() - ticked > STILL) await look();
  } catch (error) {
    if (bridge.isOpen) notice(error.message);
  }
}

async function look() {
  const { sim_time } = await bridge.call("/gazebo/get_world_properties");
  if (sim_time === looked && performance.now() - asked > SETTLES) setPaused(true);
  time = looked = sim_time;
  for (const name of boats) {
    const { pose, twist } = await bridge.call("/gazebo/get_model_state", { model_name: name });
    put(name, pose, twist);
  }
  chart.redraw();
}

function meet(names) {
  const before = pilot.boat;
  const isNew = names.join() !== boats.join();
  boats = names;
  pilot.meet(Object.fromEntries(names.map((name) => [name, world?.boats[name]?.engines ?? []])));
  for (const name of Object.keys(sent)) if (!names.includes(name)) delete sent[name];
  chart.keepOnly(names);
  if (isNew) listBoats();
  if (before !== pilot.boat || isNew) choose(pilot.boat);
  showAngle();
}

// Driving

function command(boat, wheel) {
  if (world?.cmd_vel === "velocity") {
    const linear = { x: wheel.power, y: 0, z: 0 }, angular = { x: 0, y: 0, z: wheel.turn };
    bridge.publish(`/${boat}/cmd_vel`, TWIST, { linear, angular }, isRest(wheel));
    return;
  }
  for (const [name, data] of Object.entries(engineCommands(pilot.engines[boat] ?? [], wheel))) {
    const tail = name.endsWith("_angle") ? `${name.slice(0, -6)}_thrust_angle` : `${name}_thrust_cmd`;
    bridge.publish(`/${boat}/thrusters/${tail}`, "std_msgs/Float32", { data }, isRest(wheel));
  }
}

// What is asked for, as long as it is; and once that nothing is asked for any more.
function send() {
  for (const [boat, wheel] of Object.entries(pilot.wheels)) {
    if (isRest(wheel) && sent[boat] && isRest(sent[boat])) continue;
    command(boat, wheel);
    sent[boat] = wheel;
  }
}

function letGo() {
  for (const boat of Object.keys(pilot.wheels)) command(boat, REST);
  pilot.reset();
  for (const boat of Object.keys(sent)) delete sent[boat];
}

function choose(name) {
  if (isStickHeld) pilot.set({ power: 0, turn: 0 });
  pilot.boat = name;
  chart.chosen = name;
  if (name) chart.follow(true);
  for (const button of $("boats").children) button.setAttribute("aria-pressed", button.dataset.boat === name);
  show("boat", name || "No boat");
  paint();
  show("remove", name ? `Remove ${name}` : "Remove");
  $("remove").disabled = !(bridge.isOpen && name);
  showAngle();
}

// Boats have the colours that their world gives them, as in maps and recordings.
function paint() {
  $("swatch").style.background = pilot.boat ? chart.color(pilot.boat) : "none";
  for (const button of $("boats").children) button.firstChild.style.background = chart.color(button.dataset.boat);
}

const knobReach = () => $("stick").offsetWidth / 2 - $("knob").offsetWidth / 2 + 6;
const fullWheel = () => (world?.cmd_vel === "velocity" ? FULL : { power: 1, turn: 1 });

// Where the wheel is, whether the joystick or keys turned it; within the joystick's circle.
function moveKnob(x, y) {
  const reach = knobReach() / Math.max(1, Math.hypot(x, y));
  $("knob").style.transform = `translate(${x * reach}px, ${y * reach}px)`;
}

// The joystick springs back; up is ahead, and left turns left.
function steer(event) {
  const box = $("stick").getBoundingClientRect();
  const reach = knobReach();
  let [x, y] = [(event.clientX - box.left - box.width / 2) / reach, (event.clientY - box.top - box.height / 2) / reach];
  const far = Math.hypot(x, y);
  if (far > 1) [x, y] = [x / far, y / far];
  moveKnob(x, y);
  const dead = (value) => (Math.abs(value) < 0.06 ? 0 : Math.round(value * 100) / 100);
  const full = fullWheel();
  pilot.set({ power: dead(-y) * full.power, turn: dead(-x) * full.turn });
}

function springBack() {
  if (!isStickHeld) return;
  isStickHeld = false;
  $("stick").classList.remove("held");
  pilot.set({ power: 0, turn: 0 });
  send();
}

$("stick").addEventListener("pointerdown", (event) => {
  if (!pilot.boat) return;
  $("stick").setPointerCapture(event.pointerId);
  $("stick").classList.add("held");
  isStickHeld = true;
  steer(event);
  send();
});
$("stick").addEventListener("pointermove", (event) => { if (isStickHeld) steer(event); });
for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) $("stick").addEventListener(end, springBack);
$("angle").addEventListener("input", () => pilot.set({ angle: ($("angle").value * Math.PI) / 180 }));

addEventListener("keydown", (event) => {
  const at = event.target;
  const key = keyName(event);
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (at.matches("input, summary") && /^(arrow|home|end|page| |enter)/i.test(event.key)) return;
  if (at.matches("button") && key === "space") return;
  if (key === "p") { if (!event.repeat) togglePause(); }
  else if (key === "backspace") { if (!event.repeat) reset(); }
  else {
    const before = pilot.boat;
    if (!pilot.press(key)) return;
    if (pilot.boat !== before) choose(pilot.boat);
    send();
  }
  event.preventDefault();
});

// A page that nobody sees is slowed down by browsers: boats are let go, once and cleanly.
document.addEventListener("visibilitychange", () => { if (document.hidden) letGo(); });
addEventListener("pagehide", letGo);

// What people ask of the world

async function act(button, work) {
  $(button).disabled = true;
  try {
    await work();
  } catch (error) {
    notice(error.message);
  }
  $(button).disabled = !bridge.isOpen || (button === "remove" && !pilot.boat);
}

const togglePause = () => act("pause", async () => {
  const pause = !paused;
  await bridge.call(`/gazebo/${pause ? "pause" : "unpause"}_physics`);
  asked = performance.now();
  ticked = pause ? -Infinity : asked;
  setPaused(pause);
});

const reset = () => act("reset", async () => {
  letGo();
  await bridge.call("/gazebo/reset_world");
  chart.clearTracks();
  notice("The simulation is reset.", true);
  await ask();
});

// A boat's URDF; null where the files that it was made of are not there.
async function description(boat) {
  return JSON.parse((await bridge.call("/rosapi/get_param", { name: `/${boat}/robot_description` })).value);
}

const add = () => act("add", async () => {
  const like = pilot.boat
    ? { name: pilot.boat, urdf: await description(pilot.boat), place: chart.boats.get(pilot.boat) }
    : last;
  if (!like?.urdf) throw new Error(`no robot_description of ${like?.name ?? "a boat"} to copy`);
  const { model_names } = await bridge.call("/gazebo/get_world_properties");
  const name = freeName(like.name, model_names);
  const initial_pose = spotBeside(like.place);
  const model_xml = renamed(like.urdf, like.name, name);
  await bridge.call("/gazebo/spawn_urdf_model", { model_name: name, model_xml, robot_namespace: name, initial_pose });
  notice(`${name} joins.`, true);
  await ask();
  choose(name);
});

// Where a boat joins: near this one, with its height and heading.
function spotBeside(boat) {
  if (!boat) throw new Error("the boat's position is not known yet");
  const others = [...chart.boats.values()].map(({ x, y }) => [x, y, APART]);
  const things = (world?.objects ?? []).map((item) =>
    [...(chart.things.get(item.name) ?? [item.x, item.y]), item.size / 2 + 4]);
  const cells = (world?.docks ?? []).flatMap((dock) => dock.cells.map(([x, y]) => [x, y, dock.cell + 3]));
  const spot = freeSpot(boat, [...others, ...things, ...cells], (x, y) => chart.isLand(x, y));
  if (!spot) throw new Error("no free water near the boat");
  const orientation = { x: 0, y: 0, z: Math.sin(boat.yaw / 2), w: Math.cos(boat.yaw / 2) };
  return { position: { ...spot, z: boat.z }, orientation };
}

// The first press asks, the second one does it.
function remove() {
  const name = pilot.boat;
  if ($("remove").dataset.sure !== name) {
    $("remove").dataset.sure = name;
    show("remove", `Really remove ${name}?`);
    setTimeout(settle, 4000);
    return;
  }
  settle();
  act("remove", async () => {
    delete pilot.wheels[name];
    last = { name, urdf: await description(name), place: { ...chart.boats.get(name) } };
    await bridge.call("/gazebo/delete_model", { model_name: name });
    notice(`${name} leaves.`, true);
    await ask();
  });
}

function settle() {
  delete $("remove").dataset.sure;
  show("remove", pilot.boat ? `Remove ${pilot.boat}` : "Remove");
}

// What is shown

function showTask(task) {
  $("task").hidden = false;
  const seconds = task.remaining_time.secs;
  show("task-name", task.name.replaceAll("_", " "));
  show("task-state", task.timed_out ? "timed out" : task.state);
  show("task-left", `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`);
  const scored = task.score !== null && !["initial", "ready"].includes(task.state);
  show("task-score", scored ? Number(task.score.toPrecision(4)).toString() : "none yet");
  show("task-hits", String(task.num_collisions));
}

function setPaused(now) {
  paused = now;
  show("pause", paused ? "Resume" : "Pause");
  document.body.classList.toggle("paused", paused);
  if (paused) show("pace", "–");
}

function listBoats() {
  $("boats").replaceChildren(...boats.map((name) => {
    const button = document.createElement("button");
    const [swatch, label, speed] = ["i", "span", "small"].map((kind) => document.createElement(kind));
    button.type = "button";
    button.dataset.boat = name;
    label.textContent = name;
    button.append(swatch, label, speed);
    button.addEventListener("click", () => choose(name));
    return button;
  }));
}

function showView() {
  const { length, pixels } = chart.scaleBar;
  $("bar").style.width = `${pixels}px`;
  show("bar-length", length >= 1000 ? `${length / 1000} km` : `${length} m`);
  $("follow").setAttribute("aria-pressed", chart.follows);
}

// The slider, where the boat's engines turn.
function showAngle() {
  const most = Math.round(degrees(pilot.maxAngle));
  if (Number($("angle").max) !== most) [$("angle").min, $("angle").max] = [-most, most];
  $("angle-row").hidden = most === 0 || world?.cmd_vel === "velocity";
}

function showWind() {
  $("wind").hidden = wind.speed === null || wind.direction === null;
  if ($("wind").hidden) return;
  const calm = wind.speed < 0.05;
  const [, from] = compass(wind.direction + 180).split(" ");
  show("wind-speed", calm ? "No wind" : `${wind.speed.toFixed(1)} m/s`);
  show("wind-from", calm ? "" : `wind from ${from}`);
  $("wind-arrow").setAttribute("transform", `rotate(${degrees(fromEast()) - wind.direction})`);
  $("wind-arrow").style.display = calm ? "none" : "";
}

function showFigures() {
  const boat = chart.boats.get(pilot.boat), { power, turn, angle } = pilot.wheel;
  const unit = world?.cmd_vel === "velocity" ? [" m/s", " rad/s"] : ["", ""];
  show("world", world ? world.name.replaceAll("_", " ") : bridge.isOpen ? "Waiting for the world" : "Not connected");
  show("time", time === null ? "–" : `${time.toFixed(1)} s${paused ? ", paused" : ""}`);
  show("speed", boat ? `${boat.speed.toFixed(2)} m/s` : "–");
  show("heading", boat ? compass(degrees(boat.yaw + fromEast())) : "–");
  show("course", boat ? compass(degrees(boat.course + fromEast())) : "–");
  show("yaw", boat ? `${degrees(boat.yaw).toFixed(0)}°` : "–");
  show("power", signed(power) + unit[0]);
  show("turn", signed(turn) + unit[1]);
  if (!isStickHeld) moveKnob(-turn / fullWheel().turn, -power / fullWheel().power);
  show("angle-shown", `${signed(degrees(angle), 0)}°`);
  if (document.activeElement !== $("angle") || angle === 0) $("angle").value = degrees(angle);
  for (const button of $("boats").children) {
    const speed = chart.boats.get(button.dataset.boat)?.speed;
    const text = speed === undefined ? "" : `${speed.toFixed(1)} m/s`;
    if (button.lastChild.textContent !== text) button.lastChild.textContent = text;
  }
  showWind();
}

function setConnected(isConnected, url) {
  const was = world !== null;
  $("banner").hidden = isConnected;
  show("banner", was
    ? `The connection to ${url} is lost. Trying again…`
    : `No rosbridge answers at ${url}. Start a world: vrx-mj serve WORLD --rosbridge. Trying again…`);
  for (const id of ["pause", "reset", "add"]) $(id).disabled = !isConnected;
  $("remove").disabled = !(isConnected && pilot.boat);
  document.body.classList.toggle("lost", !isConnected);
}

for (const [id, work] of [["pause", togglePause], ["reset", reset], ["add", add], ["remove", remove]]) {
  $(id).addEventListener("click", work);
}
$("in").addEventListener("click", () => chart.zoomBy(1.5));
$("out").addEventListener("click", () => chart.zoomBy(1 / 1.5));
$("fit").addEventListener("click", () => chart.fit());
$("follow").addEventListener("click", () => chart.follow(!chart.follows));

const { url, boat } = await (await fetch("/settings.json")).json();
pilot.boat = boat ?? "";
bridge = new Bridge(url, {
  opened: () => {
    time = looked = null;
    setConnected(true, url);
    ask();
  },
  closed: () => {
    pilot.reset();
    setConnected(false, url);
  },
  failed: (text) => notice(text),
});
listen();
setInterval(send, PERIOD);
setInterval(ask, 1000);
setInterval(showFigures, 100);
showView();
