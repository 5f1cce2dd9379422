// Elements of the map: a grid in metres, tracks, and hulls to scale.

const SVG = "http://www.w3.org/2000/svg";

// Outline of a hull about midships, bow to the right.
function hullPath({ length, beam }) {
  const [stern, bow, half] = [-length / 2, length / 2, beam / 2];
  return (
    `M ${stern} ${-0.8 * half} Q ${0.3 * stern} ${-half} ${0.3 * bow} ${-half} Q ${0.8 * bow} ${-0.8 * half} ${bow} 0 ` +
    `Q ${0.8 * bow} ${0.8 * half} ${0.3 * bow} ${half} Q ${0.3 * stern} ${half} ${stern} ${0.8 * half} Z`
  );
}

function makeHull(track, hull) {
  const shape = document.createElementNS(SVG, "path");
  shape.setAttribute("d", hullPath(hull));
  shape.classList.add("hull", track.role);
  shape.style.setProperty("--colour", `var(${track.colour})`);
  return shape;
}

// Position and heading at a time, interpolated between the poses of the page.
function poseAt(track, time) {
  const i = indexAt(track.time, time);
  const j = Math.min(i + 1, track.time.length - 1);
  const gap = track.time[j] - track.time[i];
  const share = gap > 0 ? Math.min(1, Math.max(0, (time - track.time[i]) / gap)) : 0;
  const between = (values) => values[i] + share * (values[j] - values[i]);
  return { x: between(track.x) + track.middle[0], y: between(track.y) + track.middle[1], heading: between(track.heading) };
}

// Bounding box of the tracks: left, right, low, high, in metres.
function bounds(tracks) {
  let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const { x, y, middle } of tracks) {
    for (let i = 0; i < x.length; i += 1) {
      left = Math.min(left, x[i] + middle[0]);
      right = Math.max(right, x[i] + middle[0]);
      low = Math.min(low, y[i] + middle[1]);
      high = Math.max(high, y[i] + middle[1]);
    }
  }
  return [left, right, low, high];
}

// Lines every 1, 2 or 5 times a power of ten metres, at least 70 pixels apart.
function drawGrid(pen, view, colours) {
  const rough = 70 / view.scale;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((n) => n * power).find((size) => size >= rough);
  pen.lineWidth = 1;
  pen.strokeStyle = colours("--grid");
  pen.fillStyle = colours("--ink-soft");
  pen.font = "11px system-ui, sans-serif";
  const [left, top] = [view.x - view.width / 2 / view.scale, view.y + view.height / 2 / view.scale];
  pen.beginPath();
  for (let n = Math.ceil(left / step); n * step < left + view.width / view.scale; n += 1) {
    const at = view.place(n * step, 0)[0];
    pen.moveTo(at, 0);
    pen.lineTo(at, view.height);
    if (at > 40) pen.fillText(shown(n * step), at + 3, view.height - 5);
  }
  for (let n = Math.floor(top / step); n * step > top - view.height / view.scale; n -= 1) {
    const at = view.place(0, n * step)[1];
    pen.moveTo(0, at);
    pen.lineTo(view.width, at);
    if (at < view.height - 30) pen.fillText(shown(n * step), 4, at - 3);
  }
  pen.stroke();
}

// The whole track in a pale colour, its part up to the current time in full, a dot at the start.
function drawTrack(pen, track, view, time, colours) {
  const now = indexAt(track.time, time);
  const at = (i) => view.place(track.x[i] + track.middle[0], track.y[i] + track.middle[1]);
  const stride = Math.max(1, Math.floor(track.time.length / 6000));
  const stroke = (first, last, opacity) => {
    pen.globalAlpha = opacity;
    pen.beginPath();
    for (let i = first; i < last; i += stride) pen.lineTo(...at(i));
    pen.lineTo(...at(last));
    pen.stroke();
  };
  pen.strokeStyle = colours(track.colour);
  pen.fillStyle = colours(track.colour);
  pen.setLineDash(track.role === "reference" ? [6, 4] : []);
  pen.lineWidth = track.role === "reference" ? 1.2 : 1.8;
  stroke(now, track.time.length - 1, 0.35);
  stroke(0, now, 1);
  pen.setLineDash([]);
  pen.beginPath();
  pen.arc(...at(0), 3, 0, 2 * Math.PI);
  pen.fill();
}
