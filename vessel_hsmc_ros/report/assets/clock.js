// State that all parts of the page share: the time of the slider, the visible time window, and listeners for changes of both.

class Clock {
  constructor(begin, end) {
    this.begin = begin;
    this.end = end;
    this.time = begin;
    this.window = [begin, end];
    this.timeListeners = [];
    this.windowListeners = [];
  }

  setTime(time) {
    this.time = Math.min(this.end, Math.max(this.begin, time));
    for (const listener of this.timeListeners) listener(this.time);
  }

  setWindow(from, to) {
    const length = Math.max(to - from, (this.end - this.begin) * 1e-6, 1e-6);
    const start = Math.max(this.begin, Math.min(from, this.end - length));
    this.window = [start, Math.min(this.end, start + length)];
    for (const listener of this.windowListeners) listener(this.window);
    this.setTime(this.time);
  }

  get zoomed() {
    return this.window[0] > this.begin || this.window[1] < this.end;
  }
}

// Playback of the visible time window: play, pause, speed.
class Player {
  constructor(clock) {
    this.clock = clock;
    this.button = document.getElementById("play");
    this.slider = document.getElementById("slider");
    this.speed = document.getElementById("speed");
    this.label = document.getElementById("time");
    this.playing = false;
    this.slider.min = clock.begin;
    this.slider.max = clock.end;
    this.slider.step = (clock.end - clock.begin) / 10000 || 1;
    this.slider.addEventListener("input", () => clock.setTime(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.toggle());
    document.addEventListener("keydown", (event) => this.onKey(event));
    clock.timeListeners.push((time) => this.show(time));
    this.chooseSpeed();
  }

  // The lowest speed that plays the whole run in half a minute.
  chooseSpeed() {
    const needed = (this.clock.end - this.clock.begin) / 30;
    const offered = [...this.speed.options].map((option) => Number(option.value));
    this.speed.value = String(offered.find((speed) => speed >= needed) ?? offered[offered.length - 1]);
  }

  onKey(event) {
    if (/^(INPUT|SELECT|BUTTON|SUMMARY|TEXTAREA|A)$/.test(event.target.tagName)) return;
    const step = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
    if (step) this.clock.setTime(this.clock.time + step * (this.clock.window[1] - this.clock.window[0]));
    else if (event.key === " ") this.toggle();
    else return;
    event.preventDefault();
  }

  toggle() {
    this.playing = !this.playing;
    this.button.classList.toggle("playing", this.playing);
    this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
    if (!this.playing) return;
    const [from, to] = this.clock.window;
    if (this.clock.time < from || this.clock.time >= to) this.clock.setTime(from);
    this.last = performance.now();
    requestAnimationFrame((now) => this.step(now));
  }

  step(now) {
    if (!this.playing) return;
    const time = this.clock.time + (Number(this.speed.value) * Math.max(0, now - this.last)) / 1000;
    this.last = now;
    const end = this.clock.window[1];
    this.clock.setTime(Math.min(time, end));
    if (time >= end) this.toggle();
    else requestAnimationFrame((next) => this.step(next));
  }

  show(time) {
    this.slider.value = time;
    this.label.textContent = moment(time, this.clock.end);
    this.slider.setAttribute("aria-valuetext", this.label.textContent);
  }
}
