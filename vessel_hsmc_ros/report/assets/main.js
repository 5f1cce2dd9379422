// Builds the page once its numbers are unpacked.

function makeCharts({ panels, marks }, clock, colours) {
  const charts = panels.map((panel, i) => new Chart(panel, document.getElementById(`panel-${i}`), clock, colours, marks));
  const byElement = new Map(charts.map((chart) => [chart.element, chart]));
  const watcher = new IntersectionObserver(
    (entries) => entries.forEach((entry) => byElement.get(entry.target).setOnScreen(entry.isIntersecting)),
    { rootMargin: "200px" },
  );
  charts.forEach((chart) => watcher.observe(chart.element));
  clock.timeListeners.push((time) => charts.forEach((chart) => chart.showTime(time)));
  clock.windowListeners.push(() => redraw(charts));
  return charts;
}

// Redraw the visible diagrams, one per frame so that the page stays responsive; others are drawn when they are scrolled into view.
function redraw(charts) {
  const idle = !charts.some((chart) => chart.onScreen && chart.stale);
  charts.forEach((chart) => (chart.stale = true));
  const next = () => {
    const chart = charts.find((each) => each.onScreen && each.stale);
    if (!chart) return;
    chart.draw();
    requestAnimationFrame(next);
  };
  if (idle) next();
}

function listenToWindow(clock) {
  const label = document.getElementById("window");
  const reset = document.getElementById("reset");
  clock.windowListeners.push(([from, to]) => {
    label.textContent = clock.zoomed ? `${moment(from, clock.end)} to ${moment(to, clock.end)}` : "";
    reset.disabled = !clock.zoomed;
  });
  reset.addEventListener("click", () => clock.setWindow(clock.begin, clock.end));
  document.getElementById("around").addEventListener("click", () => {
    const half = 0.1 * (clock.window[1] - clock.window[0]);
    clock.setWindow(clock.time - half, clock.time + half);
  });
}

function listenToParameters() {
  const [text, changed] = [document.getElementById("search"), document.getElementById("changed")];
  const rows = [...document.querySelectorAll("#parameters tbody tr")];
  const filter = () => {
    const wanted = text.value.toLowerCase();
    for (const row of rows) row.hidden = !row.dataset.text.includes(wanted) || (changed.checked && !("changed" in row.dataset));
    for (const node of document.querySelectorAll("#parameters details")) {
      const left = [...node.querySelectorAll("tbody tr")].filter((row) => !row.hidden).length;
      node.hidden = left === 0;
      if (wanted || changed.checked) node.open = left > 0;
    }
  };
  text?.addEventListener("input", filter);
  changed?.addEventListener("input", filter);
}

function unpackAll(content, bytes) {
  const known = new Map();
  const array = (where) => {
    if (!known.has(where.at)) known.set(where.at, unpack(bytes, where));
    return known.get(where.at);
  };
  for (const panel of content.panels) {
    for (const line of panel.lines) Object.assign(line, { time: array(line.time), values: array(line.values) });
  }
  for (const track of content.tracks) {
    for (const name of ["time", "x", "y", "heading"]) track[name] = array(track[name]);
  }
  for (const stop of content.stops) {
    for (const name of ["time", "reach", "radius"]) stop[name] = array(stop[name]);
  }
  for (const line of content.plans.flatMap((plan) => plan.outlines)) Object.assign(line, { x: array(line.x), y: array(line.y) });
}

async function main() {
  const { content, colours, redraws } = await drawFigures();
  unpackAll(content, await inflate("numbers"));

  const clock = new Clock(content.begin, content.end);
  const charts = makeCharts(content, clock, colours);
  const map = new ShipMap(content, clock, colours);
  const player = new Player(clock);
  listenToWindow(clock);
  listenToParameters();
  listenToEvents(content.marks, clock);
  listenToMenus();
  redraws.push(() => {
    redraw(charts);
    map.draw();
  });
  clock.setTime(clock.begin);
  window.report = { clock, player, charts, map, quantity, csvOf };
  document.documentElement.dataset.ready = "";
}

main().catch(showTrouble);
