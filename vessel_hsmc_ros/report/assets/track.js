// Elements of the map: a grid in metres, tracks, and hulls to scale.

const SVG = "http://www.w3.org/2000/svg";
const KEY_LINE = 18; // pixels

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

// Lines every 1, 2 or 5 times a power of ten metres, at least 70 pixels apart, and the names of the axes.
function drawGrid(pen, view, colours) {
  const [left, top] = [view.x - view.width / 2 / view.scale, view.y + view.height / 2 / view.scale];
  const [right, bottom] = [left + view.width / view.scale, top - view.height / view.scale];
  const [factor, unit] = niceStep(70 / view.scale) >= 1000 ? [1e-3, "km"] : [1, "m"];
  const across = ticks(left, right, (view.width / 70) * 0.999, factor);
  const up = ticks(bottom, top, (view.height / 70) * 0.999, factor);
  pen.lineWidth = 1;
  pen.strokeStyle = colours("--grid");
  pen.fillStyle = colours("--ink-soft");
  pen.font = "11px system-ui, sans-serif";
  pen.beginPath();
  const [eastName, northName] = [`x, east [${unit}]`, `y, north [${unit}]`];
  const nameLeft = view.width - pen.measureText(eastName).width - 8;
  across.places.forEach((x, i) => {
    const at = view.place(x, 0)[0];
    pen.moveTo(at, 0);
    pen.lineTo(at, view.height);
    if (at > 40 && at + 3 + pen.measureText(across.texts[i]).width < nameLeft - 6) pen.fillText(across.texts[i], at + 3, view.height - 6);
  });
  up.places.forEach((y, i) => {
    const at = view.place(0, y)[1];
    pen.moveTo(0, at);
    pen.lineTo(view.width, at);
    if (at > 34 && at < view.height - 24) pen.fillText(up.texts[i], 6, at - 3);
  });
  pen.stroke();
  pen.fillText(eastName, nameLeft, view.height - 6);
  pen.fillText(northName, 6, 16);
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

// The planned legs as a wide pale line, their waypoints as rings.
function drawPlan(pen, plan, view, colours) {
  pen.strokeStyle = colours("--plan");
  pen.setLineDash([]);
  pen.lineWidth = 5;
  for (const { x, y, middle } of plan.outlines) {
    pen.beginPath();
    for (let i = 0; i < x.length; i += 1) pen.lineTo(...view.place(x[i] + middle[0], y[i] + middle[1]));
    pen.stroke();
  }
  pen.strokeStyle = colours("--ink-soft");
  pen.lineWidth = 1.2;
  for (const point of plan.waypoints) {
    pen.beginPath();
    pen.arc(...view.place(...point), 4.5, 0, 2 * Math.PI);
    pen.stroke();
  }
}

// The sides of a polygon of the fence.
function drawFence(pen, ring, view, colours) {
  pen.strokeStyle = colours("--ink-soft");
  pen.setLineDash([8, 4]);
  pen.lineWidth = 1.5;
  pen.beginPath();
  for (const corner of ring) pen.lineTo(...view.place(...corner));
  pen.closePath();
  pen.stroke();
  pen.setLineDash([]);
}

// Where the ship would come to rest in still water if it braked now: the way ahead of it, as wide as the set.
function drawStop(pen, stop, tracks, view, time, colours) {
  const ship = tracks.find((track) => track.role === "ship" && track.run === stop.run);
  if (!ship) return;
  const { x, y, heading } = poseAt(ship, time);
  const i = indexAt(stop.time, time);
  const reach = stop.reach[i];
  pen.strokeStyle = colours("--ink-soft");
  pen.globalAlpha = 0.35;
  pen.lineWidth = Math.max(4, 2 * stop.radius[i] * view.scale);
  pen.lineCap = "round";
  pen.beginPath();
  pen.moveTo(...view.place(x, y));
  pen.lineTo(...view.place(x + reach * Math.cos(heading), y + reach * Math.sin(heading)));
  pen.stroke();
  pen.globalAlpha = 1;
  pen.lineCap = "butt";
}

// A diamond on the track of the ship at the time of an event.
function drawMark(pen, mark, tracks, view, colours) {
  const ship = tracks.find((track) => track.role === "ship" && track.run === mark.run);
  if (!ship) return;
  const pose = poseAt(ship, mark.t);
  const [x, y] = view.place(pose.x, pose.y);
  pen.beginPath();
  for (const [dx, dy] of [[0, -6], [6, 0], [0, 6], [-6, 0]]) pen.lineTo(x + dx, y + dy);
  pen.closePath();
  pen.fillStyle = colours("--card");
  pen.strokeStyle = colours(mark.colour);
  pen.lineWidth = 1.8;
  pen.fill();
  pen.stroke();
}

// The hulls on a canvas, for the picture of the map.
function drawHulls(pen, tracks, hull, view, time, colours) {
  for (const track of tracks.slice().reverse()) {
    const pose = poseAt(track, time);
    const ship = track.role === "ship";
    pen.save();
    pen.translate(...view.place(pose.x, pose.y));
    pen.rotate(-pose.heading);
    pen.scale(view.scale, view.scale);
    pen.lineWidth = 1.5 / view.scale;
    pen.setLineDash(ship ? [] : [4 / view.scale, 2 / view.scale]);
    pen.fillStyle = pen.strokeStyle = colours(track.colour);
    pen.globalAlpha = ship ? 0.6 : 0.12;
    pen.fill(new Path2D(hullPath(hull)));
    pen.globalAlpha = 1;
    pen.stroke(new Path2D(hullPath(hull)));
    pen.restore();
  }
}

// The names of the tracks on a canvas, for the picture of the map.
function drawKey(pen, tracks, colours) {
  pen.font = "12px system-ui, sans-serif";
  pen.lineWidth = 2.5;
  tracks.forEach((track, i) => {
    const y = 16 + KEY_LINE * i;
    pen.strokeStyle = colours(track.colour);
    pen.setLineDash(track.role === "reference" ? [6, 4] : []);
    pen.beginPath();
    pen.moveTo(10, y);
    pen.lineTo(32, y);
    pen.stroke();
    pen.fillStyle = colours("--ink");
    pen.fillText(track.label, 38, y + 4);
  });
}

// The page's north arrow on a canvas, for the picture of the map.
function drawNorth(pen, view, colours) {
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = colours("--ink-soft");
  pen.translate(view.width - 38, 8);
  pen.fill(new Path2D(document.querySelector(".north path").getAttribute("d")));
  pen.fillText("N", 11, 46);
}
