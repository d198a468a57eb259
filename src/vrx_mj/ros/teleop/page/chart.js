// The map: what does not move, boats with their tracks, and a view that pans, zooms and follows. Lengths in m.

const HULL = 4.9; // length of a WAM-V
const SHORTEST = 26; // of a boat that is drawn [px]
const TRACK = { apart: 0.4, most: 4000 };
const ZOOMS = [0.02, 60]; // [px / m]
const ROOM = 90; // shown around a boat at first

export class Chart {
  constructor(canvas, { chosen, changed }) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.on = { chosen, changed };
    this.ground = { shore: [], docks: [], objects: [], course: [], boats: {} };
    this.boats = new Map(); // name: {x, y, yaw, speed, track}
    this.things = new Map(); // floating objects: name: [x, y]
    this.chosen = "";
    this.follows = true;
    this.view = { x: 0, y: 0, zoom: 4 };
    this.isPlaced = false;
    this.pointers = new Map();
    this.listen();
  }

  color(name) {
    return this.ground.boats[name]?.color ?? "gray"; // until the world's next message
  }

  setGround(ground) {
    this.ground = ground;
    this.shore = new Path2D();
    for (const ring of ground.shore) {
      ring.forEach(([x, y], index) => (index ? this.shore.lineTo(x, y) : this.shore.moveTo(x, y)));
      this.shore.closePath();
    }
    this.redraw();
  }

  isLand(x, y) {
    this.pen.setTransform(1, 0, 0, 1, 0, 0); // the shore's path is in m, and so is the point
    return this.shore ? this.pen.isPointInPath(this.shore, x, y) : false;
  }

  place(name, x, y, yaw, speed) {
    const boat = this.boats.get(name) ?? { track: [] };
    const last = boat.track.at(-1);
    const moved = last ? Math.hypot(x - last[0], y - last[1]) : Infinity;
    if (last && moved > 25) boat.track = []; // it was put there
    if (moved > TRACK.apart) boat.track.push([x, y]);
    if (boat.track.length > TRACK.most) boat.track.shift();
    this.boats.set(name, Object.assign(boat, { x, y, yaw, speed }));
  }

  keepOnly(names) {
    for (const name of this.boats.keys()) if (!names.includes(name)) this.boats.delete(name);
  }

  clearTracks() {
    for (const boat of this.boats.values()) boat.track = [];
  }

  // Everything that boats may have to do with: boats, the course, and else the objects.
  fit() {
    const spots = [...this.boats.values()].map(({ x, y }) => [x, y]);
    spots.push(...this.ground.course, ...this.ground.docks.flatMap((dock) => dock.cells));
    if (spots.length <= this.boats.size) spots.push(...this.ground.objects.map(({ x, y }) => [x, y]));
    if (!spots.length) spots.push([0, 0]);
    const [west, east] = extent(spots.map(([x]) => x));
    const [south, north] = extent(spots.map(([, y]) => y));
    const { width, height } = this.canvas.getBoundingClientRect();
    const zoom = Math.min(width / (east - west + 60), height / (north - south + 60));
    this.view = { x: (west + east) / 2, y: (south + north) / 2, zoom: Math.min(zoom, 8) };
    this.follow(false);
  }

  follow(follows) {
    this.follows = follows;
    this.on.changed();
    this.redraw();
  }

  zoomBy(factor, at) {
    const { x, y } = at ? this.toWorld(at.x, at.y) : this.view;
    const zoom = Math.min(Math.max(this.view.zoom * factor, ZOOMS[0]), ZOOMS[1]);
    const kept = at && !this.follows ? this.view.zoom / zoom : 1;
    this.view.x = x + (this.view.x - x) * kept;
    this.view.y = y + (this.view.y - y) * kept;
    if (this.follows) this.center();
    this.view.zoom = zoom;
    this.on.changed();
    this.redraw();
  }

  toWorld(px, py) {
    const box = this.canvas.getBoundingClientRect();
    const { x, y, zoom } = this.view;
    return { x: x + (px - box.left - box.width / 2) / zoom, y: y - (py - box.top - box.height / 2) / zoom };
  }

  center() {
    const boat = this.boats.get(this.chosen);
    if (!boat) return;
    this.view.x = boat.x;
    this.view.y = boat.y;
    if (this.isPlaced) return;
    const { width, height } = this.canvas.getBoundingClientRect();
    this.view.zoom = Math.min(width, height) / ROOM;
    this.isPlaced = true;
    this.on.changed();
  }

  listen() {
    const { canvas, pointers } = this;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), { x: event.clientX, y: event.clientY });
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      this.dragged = 0;
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("pointerup", (event) => {
      if (pointers.size === 1 && this.dragged < 6) this.choose(event);
      pointers.delete(event.pointerId);
    });
    canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
    new ResizeObserver(() => this.redraw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = { x: event.clientX, y: event.clientY };
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    this.dragged += Math.hypot(now.x - before.x, now.y - before.y);
    if (other) {
      const apart = (one) => Math.hypot(one.x - other.x, one.y - other.y) || 1;
      this.zoomBy(apart(now) / apart(before), { x: (now.x + other.x) / 2, y: (now.y + other.y) / 2 });
    } else if (this.dragged > 6) {
      this.view.x -= (now.x - before.x) / this.view.zoom;
      this.view.y += (now.y - before.y) / this.view.zoom;
      this.follow(false);
    }
  }

  choose(event) {
    const { x, y } = this.toWorld(event.clientX, event.clientY);
    const near = [...this.boats].map(([name, boat]) => [Math.hypot(boat.x - x, boat.y - y), name]).sort((a, b) => a[0] - b[0]);
    if (near.length && near[0][0] * this.view.zoom < SHORTEST) this.on.chosen(near[0][1]);
  }

  redraw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.draw();
    });
  }

  draw() {
    const { canvas, pen } = this;
    const { width, height } = canvas.getBoundingClientRect();
    const dense = devicePixelRatio;
    if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(height * dense)) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
    }
    if (this.follows) this.center();
    const style = getComputedStyle(canvas);
    this.ink = (name) => style.getPropertyValue(`--${name}`);
    const { x, y, zoom } = this.view;
    this.toScreen = (east, north) => [width / 2 + (east - x) * zoom, height / 2 - (north - y) * zoom];
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.fillStyle = this.ink("water");
    pen.fillRect(0, 0, width, height);
    this.drawShore(dense, width, height);
    this.drawGrid(width, height);
    this.drawDocks();
    this.drawObjects();
    this.drawCourse();
    for (const [name, boat] of this.boats) this.drawTrack(name, boat);
    for (const [name, boat] of this.boats) this.drawBoat(name, boat);
    this.drawNames();
  }

  // The length of a scale bar of at most `most` px: a round one.
  get scaleBar() {
    const most = 120 / this.view.zoom;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = power * [5, 2, 1].find((step) => step * power <= most);
    return { length, pixels: length * this.view.zoom };
  }

  drawShore(dense, width, height) {
    if (!this.shore) return;
    const { pen } = this;
    const { x, y, zoom } = this.view;
    pen.save();
    pen.translate(width / 2, height / 2);
    pen.scale(zoom, -zoom);
    pen.translate(-x, -y);
    pen.fillStyle = this.ink("land");
    pen.fill(this.shore);
    pen.strokeStyle = this.ink("shore");
    pen.lineWidth = 1.2 / zoom;
    pen.stroke(this.shore);
    pen.restore();
  }

  drawGrid(width, height) {
    const { pen } = this;
    const { x, y, zoom } = this.view;
    const step = this.scaleBar.length;
    pen.strokeStyle = this.ink("grid");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let east = Math.ceil((x - width / 2 / zoom) / step) * step; ; east += step) {
      const [px] = this.toScreen(east, 0);
      if (px > width) break;
      pen.moveTo(Math.round(px) + 0.5, 0);
      pen.lineTo(Math.round(px) + 0.5, height);
    }
    for (let north = Math.ceil((y - height / 2 / zoom) / step) * step; ; north += step) {
      const [, py] = this.toScreen(0, north);
      if (py < 0) break;
      pen.moveTo(0, Math.round(py) + 0.5);
      pen.lineTo(width, Math.round(py) + 0.5);
    }
    pen.stroke();
  }

  drawDocks() {
    const { pen } = this;
    pen.fillStyle = this.ink("dock");
    for (const dock of this.ground.docks) {
      const half = (dock.cell / 2) * this.view.zoom;
      for (const [x, y] of dock.cells) {
        pen.save();
        pen.translate(...this.toScreen(x, y));
        pen.rotate(-dock.yaw);
        pen.fillRect(-half, -half, 2 * half + 0.3, 2 * half + 0.3);
        pen.restore();
      }
    }
  }

  drawObjects() {
    const { pen } = this;
    pen.strokeStyle = this.ink("edge");
    pen.lineWidth = 1;
    for (const item of this.ground.objects) {
      const [x, y] = this.toScreen(...(this.things.get(item.name) ?? [item.x, item.y]));
      pen.beginPath();
      pen.arc(x, y, Math.max((item.size / 2) * this.view.zoom, 3), 0, 2 * Math.PI);
      pen.fillStyle = item.color;
      pen.fill();
      pen.stroke();
    }
  }

  drawCourse() {
    const { pen } = this;
    const spots = this.ground.course.map(([x, y, yaw]) => [...this.toScreen(x, y), yaw]);
    pen.strokeStyle = pen.fillStyle = this.ink("accent");
    pen.lineWidth = 1.5;
    pen.setLineDash([5, 5]);
    pen.beginPath();
    spots.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
    pen.setLineDash([]);
    pen.font = "600 12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    spots.forEach(([x, y, yaw], index) => {
      pen.fillStyle = this.ink("accent");
      pen.beginPath();
      pen.arc(x, y, 11, 0, 2 * Math.PI);
      pen.fill();
      pen.beginPath();
      pen.moveTo(x + 11 * Math.cos(yaw), y - 11 * Math.sin(yaw));
      pen.lineTo(x + 19 * Math.cos(yaw), y - 19 * Math.sin(yaw));
      pen.lineWidth = 3;
      pen.stroke();
      pen.fillStyle = this.ink("on-accent");
      pen.fillText(spots.length > 1 ? index + 1 : "G", x, y + 0.5);
    });
  }

  drawTrack(name, boat) {
    const { pen } = this;
    pen.strokeStyle = this.color(name);
    pen.globalAlpha = 0.55;
    pen.lineWidth = 2;
    pen.lineJoin = "round";
    pen.beginPath();
    [...boat.track, [boat.x, boat.y]].forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](...this.toScreen(x, y)));
    pen.stroke();
    pen.globalAlpha = 1;
  }

  drawBoat(name, boat) {
    const { pen } = this;
    const [x, y] = this.toScreen(boat.x, boat.y);
    const half = Math.max(HULL * this.view.zoom, SHORTEST) / 2;
    pen.save();
    pen.translate(x, y);
    if (name === this.chosen) {
      pen.beginPath();
      pen.arc(0, 0, half + 7, 0, 2 * Math.PI);
      pen.strokeStyle = this.color(name);
      pen.lineWidth = 1.5;
      pen.stroke();
    }
    pen.rotate(-boat.yaw);
    pen.beginPath();
    pen.moveTo(half, 0);
    pen.lineTo(-0.8 * half, 0.62 * half);
    pen.lineTo(-0.45 * half, 0);
    pen.lineTo(-0.8 * half, -0.62 * half);
    pen.closePath();
    pen.lineJoin = "round";
    pen.lineWidth = 2.5;
    pen.strokeStyle = this.ink("rim");
    pen.stroke();
    pen.fillStyle = this.color(name);
    pen.fill();
    pen.restore();
  }

  // The chosen boat's name first; one that would cover another is left out.
  drawNames() {
    const { pen } = this;
    const written = [];
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.lineWidth = 3.5;
    pen.strokeStyle = this.ink("water");
    pen.fillStyle = this.ink("ink");
    for (const [name, boat] of [...this.boats].sort(([a], [b]) => (b === this.chosen) - (a === this.chosen))) {
      pen.font = `${name === this.chosen ? 650 : 500} 13px system-ui, sans-serif`;
      const half = pen.measureText(name).width / 2;
      const [x, middle] = this.toScreen(boat.x, boat.y);
      const y = middle + Math.max(HULL * this.view.zoom, SHORTEST) / 2 + 11;
      if (written.some((other) => Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < 15)) continue;
      written.push({ x, y, half });
      pen.strokeText(name, x, y);
      pen.fillText(name, x, y);
    }
  }
}

const extent = (values) => [Math.min(...values), Math.max(...values)];
