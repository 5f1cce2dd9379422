// The ship on its track beside its reference, seen from above: tracks on a canvas, hulls as shapes above it.

const EDGE = 26; // pixels that the labels of the axes need

// The visible part of the plane: its centre in metres, pixels per metre, its size in pixels.
class View {
  constructor() {
    Object.assign(this, { x: 0, y: 0, scale: 1, width: 1, height: 1 });
  }

  place(x, y) {
    return [0.5 * this.width + (x - this.x) * this.scale, 0.5 * this.height - (y - this.y) * this.scale];
  }
}

class ShipMap {
  constructor({ tracks, plans, fences, stops, hull, marks }, clock, colours) {
    Object.assign(this, { tracks, plans, fences, stops, hull, clock, colours, marks, view: new View(), following: false, moved: false });
    this.box = document.querySelector("#map .view");
    this.canvas = this.box.querySelector("canvas");
    this.hulls = tracks.map((track) => makeHull(track, hull));
    this.box.querySelector("svg.hulls").append(...this.hulls.slice().reverse());
    document.getElementById("fit").addEventListener("click", () => this.fit());
    document.getElementById("follow").addEventListener("click", () => this.follow());
    document.getElementById("closer").addEventListener("click", () => this.zoom(1.5));
    document.getElementById("wider").addEventListener("click", () => this.zoom(1 / 1.5));
    document.getElementById("picture").addEventListener("click", () => this.save());
    this.box.addEventListener("keydown", (event) => this.onKey(event));
    this.listenToPointer();
    clock.timeListeners.push(() => this.draw());
    new ResizeObserver(() => (this.moved ? this.draw() : this.fit())).observe(this.box);
    this.fit();
  }

  listenToPointer() {
    let held = null;
    this.box.addEventListener("pointerdown", (event) => {
      held = { x: event.clientX, y: event.clientY, dragged: false };
      this.box.setPointerCapture(event.pointerId);
    });
    this.box.addEventListener("pointermove", (event) => {
      if (!held) return;
      const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
      if (!held.dragged && Math.hypot(dx, dy) < 4) return;
      Object.assign(held, { x: event.clientX, y: event.clientY, dragged: true });
      this.view.x -= dx / this.view.scale;
      this.view.y += dy / this.view.scale;
      this.moved = true;
      this.setFollowing(false);
    });
    this.box.addEventListener("pointerup", (event) => {
      if (held && !held.dragged) this.pick(event);
      held = null;
    });
    this.box.addEventListener("pointercancel", () => (held = null));
    this.box.addEventListener("wheel", (event) => this.onWheel(event), { passive: false });
  }

  onWheel(event) {
    if (!event.ctrlKey) return; // the page scrolls
    event.preventDefault();
    this.zoom(Math.exp(-0.005 * event.deltaY));
  }

  onKey(event) {
    const pan = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (pan) {
      this.view.x += (40 * pan[0]) / this.view.scale;
      this.view.y += (40 * pan[1]) / this.view.scale;
      this.moved = true;
      this.setFollowing(false);
    } else if (event.key === "+") this.zoom(1.5);
    else if (event.key === "-") this.zoom(1 / 1.5);
    else if (event.key === "0") this.fit();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // A click on a track moves the slider to that time.
  pick(event) {
    const box = this.box.getBoundingClientRect();
    const [toX, toY] = [event.clientX - box.left, event.clientY - box.top];
    let [best, time] = [20, null];
    for (const track of this.tracks.filter((each) => each.role === "ship")) {
      for (let i = 0; i < track.time.length; i += 1) {
        const [x, y] = this.view.place(track.x[i] + track.middle[0], track.y[i] + track.middle[1]);
        const distance = Math.hypot(x - toX, y - toY);
        if (distance < best) [best, time] = [distance, track.time[i]];
      }
    }
    if (time !== null) this.clock.setTime(time);
  }

  fit() {
    this.measure();
    const [left, right, low, high] = bounds([...this.tracks, ...this.plans.flatMap((plan) => plan.outlines)]);
    const margin = 0.6 * this.hull.length;
    const [width, height] = [Math.max(1, this.view.width - 2 * EDGE), Math.max(1, this.view.height - 2 * EDGE)];
    const scale = Math.min(width / (right - left + 2 * margin), height / (high - low + 2 * margin));
    Object.assign(this.view, { x: 0.5 * (left + right), y: 0.5 * (low + high), scale });
    this.moved = false;
    this.setFollowing(false);
  }

  // Keep the first ship in the centre, its hull a fifth of the map's width.
  follow() {
    if (!this.following) this.view.scale = Math.max(this.view.scale, (0.2 * this.view.width) / this.hull.length);
    this.moved = true;
    this.setFollowing(!this.following);
  }

  setFollowing(following) {
    this.following = following;
    document.getElementById("follow").setAttribute("aria-pressed", String(following));
    this.draw();
  }

  zoom(factor) {
    this.view.scale *= factor;
    this.moved = true;
    this.draw();
  }

  measure() {
    [this.view.width, this.view.height] = [Math.max(1, this.box.clientWidth), Math.max(1, this.box.clientHeight)];
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(this.view.width * ratio), Math.round(this.view.height * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    return pen;
  }

  draw() {
    const time = this.clock.time;
    const poses = this.tracks.map((track) => poseAt(track, time));
    if (this.following) Object.assign(this.view, { x: poses[0].x, y: poses[0].y });
    const pen = this.measure();
    pen.clearRect(0, 0, this.view.width, this.view.height);
    drawGrid(pen, this.view, this.colours);
    for (const ring of this.fences) drawFence(pen, ring, this.view, this.colours);
    for (const plan of this.plans) drawPlan(pen, plan, this.view, this.colours);
    for (const stop of this.stops) drawStop(pen, stop, this.tracks, this.view, time, this.colours);
    for (const track of this.tracks) drawTrack(pen, track, this.view, time, this.colours);
    for (const mark of this.marks) drawMark(pen, mark, this.tracks, this.view, this.colours);
    poses.forEach((pose, i) => this.placeHull(this.hulls[i], pose));
    this.showPose(poses[0]);
  }

  placeHull(shape, pose) {
    const [x, y] = this.view.place(pose.x, pose.y);
    const degrees = (-180 / Math.PI) * pose.heading;
    shape.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${degrees.toFixed(3)}) scale(${this.view.scale})`);
  }

  showPose({ x, y, heading }) {
    const degrees = (180 / Math.PI) * heading;
    const turned = degrees - 360 * Math.ceil((degrees - 180) / 360);
    document.getElementById("pose").textContent = `x ${x.toFixed(2)} m   y ${y.toFixed(2)} m   ψ ${turned.toFixed(1)}°`;
  }

  // Save what is visible, with hulls, north arrow, and the names of the tracks above.
  async save() {
    const picture = document.createElement("canvas");
    const ratio = this.canvas.width / this.view.width;
    const above = Math.round(ratio * (12 + KEY_LINE * this.tracks.length));
    Object.assign(picture, { width: this.canvas.width, height: this.canvas.height + above });
    const pen = picture.getContext("2d");
    pen.fillStyle = this.colours("--water");
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.scale(ratio, ratio);
    drawKey(pen, this.tracks, this.colours);
    pen.setTransform(1, 0, 0, 1, 0, above);
    pen.drawImage(this.canvas, 0, 0);
    pen.setTransform(ratio, 0, 0, ratio, 0, above);
    drawHulls(pen, this.tracks, this.hull, this.view, this.clock.time, this.colours);
    drawNorth(pen, this.view, this.colours);
    save("map.png", await new Promise((done) => picture.toBlob(done, "image/png")));
  }
}
