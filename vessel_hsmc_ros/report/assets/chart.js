// One diagram over time: a Plotly figure with its legend, its limits and the events of the run.

const HEIGHT = 196;

class Chart {
  constructor(panel, element, clock, colours, marks) {
    Object.assign(this, { panel, element, clock, colours });
    this.plot = element.querySelector(".plot");
    this.cursor = element.querySelector(".cursor");
    this.note = element.querySelector(".note");
    this.unit = element.querySelector(".unit");
    this.whole = false; // whether a short peak may determine the scale
    this.onScreen = false;
    this.stale = true;
    this.drawn = false;
    this.margin = { l: window.innerWidth < 600 ? 46 : 58, r: 14, t: marks.length ? 22 : 8, b: 38 };
    this.legend = new Legend(panel, element.querySelector(".legend"), () => this.draw());
    this.marks = new MarkLayer(element.querySelector(".frame"), marks, this.margin, clock);
    this.note.addEventListener("click", () => {
      this.whole = !this.whole;
      this.draw();
    });
    listenToTools(this);
  }

  get outputs() {
    return this.legend.outputs;
  }

  get width() {
    return Math.max(1, this.plot.clientWidth - this.margin.l - this.margin.r);
  }

  setOnScreen(onScreen) {
    this.onScreen = onScreen;
    if (onScreen && this.stale) this.draw();
    if (onScreen) this.showTime(this.clock.time);
  }

  draw() {
    this.stale = !this.onScreen;
    if (this.stale) return;
    const { traces, layout } = this.figure();
    if (this.drawn) {
      Plotly.react(this.plot, traces, layout);
    } else {
      this.drawn = true;
      Plotly.newPlot(this.plot, traces, layout, { displayModeBar: false, responsive: true, doubleClick: false });
      this.plot.on("plotly_relayout", (change) => this.onRelayout(change));
      this.plot.on("plotly_doubleclick", () => this.clock.setWindow(this.clock.begin, this.clock.end));
      this.plot.on("plotly_click", (event) => this.clock.setTime(event.points[0].x));
    }
    this.marks.draw(this.width);
    this.showTime(this.clock.time);
  }

  // The visible part of the lines, and the layout that suits it.
  figure() {
    const [from, to] = this.clock.window;
    const traces = this.legend.lines.map((line) => this.trace(line, visible(line, from, to, this.plot.clientWidth)));
    return { traces, layout: this.layout(this.range(traces)) };
  }

  trace(line, points) {
    return {
      ...points,
      text: Array.from(points.y, (value) => quantity(value, this.panel.unit)),
      type: "scatter",
      mode: "lines",
      name: line.label,
      line: {
        color: this.colours(line.colour),
        dash: line.dash,
        width: line.width,
        shape: this.panel.step ? "hv" : "linear",
        simplify: false,
      },
      hovertemplate: "%{text}",
    };
  }

  layout(range) {
    const ink = this.colours("--ink-soft");
    const axis = { color: ink, gridcolor: this.colours("--grid"), zeroline: false, linecolor: this.colours("--grid"), tickmode: "array" };
    const [from, to] = this.clock.window;
    const [perTime, timeName] = timeUnit(to - from);
    const [factor, unit] = axisUnit(Math.max(Math.abs(range[0]), Math.abs(range[1])), this.panel.unit);
    this.unit.textContent = unit ? `[${unit}]` : "";
    const across = ticks(from, to, Math.max(2, this.width / 80), perTime);
    const up = ticks(...range, 6, factor);
    return {
      height: HEIGHT,
      margin: this.margin,
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 11, color: ink },
      showlegend: false,
      hovermode: "x unified",
      hoverlabel: { bgcolor: this.colours("--card"), bordercolor: this.colours("--grid"), font: { color: this.colours("--ink") } },
      dragmode: "zoom",
      xaxis: {
        ...axis,
        range: [from, to],
        tickvals: across.places,
        ticktext: across.texts,
        title: { text: `time [${timeName}]`, standoff: 3, font: { size: 11 } },
        hoverformat: ".2f",
        unifiedhovertitle: { text: "%{x:.2f} s" },
      },
      yaxis: { ...axis, range, fixedrange: true, tickvals: up.places, ticktext: up.texts },
      ...this.limits(range),
    };
  }

  // The limits within a range as lines, and their names at the upper ones; names that would overlap share a line.
  limits([low, high]) {
    const colour = this.colours("--limit");
    const shapes = this.panel.limits.flatMap(({ value, dash }) =>
      [-value, value].filter((y) => y >= low && y <= high).map((y) => ({
        type: "line",
        xref: "paper",
        x0: 0,
        x1: 1,
        y0: y,
        y1: y,
        line: { color: colour, width: 1.2, dash },
      })),
    );
    const annotations = [];
    for (const { value, name } of this.panel.limits.filter((limit) => limit.value <= high).sort((a, b) => b.value - a.value)) {
      const near = annotations.find((each) => each.y - value < 0.09 * (high - low));
      if (near) near.text += `, ${name}`;
      else annotations.push({ xref: "paper", x: 1, xanchor: "right", y: value, yanchor: "bottom", text: name, showarrow: false, borderpad: 0, font: { size: 10, color: colour } });
    }
    return { shapes, annotations };
  }

  // Range of the visible values; a short peak far beyond the others is excluded, and a note gives its value.
  range(traces) {
    const values = traces.flatMap((trace) => Array.from(trace.y)).filter(Number.isFinite).sort((a, b) => a - b);
    this.note.textContent = "";
    if (!values.length) return [-1, 1];
    const part = (share) => values[Math.round(share * (values.length - 1))];
    let [low, high] = [values[0], values[values.length - 1]];
    const [calmLow, calmHigh] = [part(0.02), part(0.98)];
    const room = Math.max(calmHigh - calmLow, 1e-9 * Math.max(Math.abs(low), Math.abs(high)));
    if (high > calmHigh + 4 * room || low < calmLow - 4 * room) {
      const peak = Math.abs(high) > Math.abs(low) ? high : low;
      const text = `peak of ${quantity(peak, this.panel.unit)} beyond the scale: show`;
      this.note.textContent = this.whole ? "exclude peaks from the scale" : text;
      if (!this.whole) [low, high] = [calmLow - 0.5 * room, calmHigh + 0.5 * room];
    }
    const reach = Math.max(Math.abs(low), Math.abs(high));
    const close = this.panel.limits.filter(({ value }) => value <= 4 * reach);
    for (const { value } of close) [low, high] = [Math.min(low, -value), Math.max(high, value)];
    if (values[0] >= 0) low = Math.max(low, 0);
    const pad = (close.length ? 0.12 : 0.06) * (high - low) || 0.05 * Math.abs(high) || 1; // room for the names of limits
    return [low - pad, high + pad];
  }

  onRelayout(change) {
    const [from, to] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (from !== undefined && to !== undefined) this.clock.setWindow(Number(from), Number(to));
  }

  showTime(time) {
    if (!this.onScreen) return;
    const [from, to] = this.clock.window;
    this.cursor.hidden = time < from || time > to;
    this.cursor.style.transform = `translateX(${this.margin.l + (this.width * (time - from)) / (to - from || 1)}px)`;
    this.legend.showTime(time);
  }
}
