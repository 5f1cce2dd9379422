// One diagram over time: a Plotly figure with a legend that shows the values at the slider's time.

const MARGIN = { l: 62, r: 14, t: 8, b: 24 };
const DASHES = { main: "solid", desired: "6px,4px", other: "2px,2px", third: "8px,3px,2px,3px", measured: "solid" };
const WIDTHS = { main: 1.6, desired: 1.4, other: 1.4, third: 1.4, measured: 0.8 };

class Chart {
  constructor(panel, element, clock, colours) {
    Object.assign(this, { panel, element, clock, colours });
    this.plot = element.querySelector(".plot");
    this.cursor = element.querySelector(".cursor");
    this.note = element.querySelector(".note");
    this.whole = false; // whether a short peak may determine the scale
    this.hidden = new Set();
    this.onScreen = false;
    this.stale = true;
    this.drawn = false;
    this.makeLegend(element.querySelector(".legend"));
    this.note.addEventListener("click", () => {
      this.whole = !this.whole;
      this.draw();
    });
  }

  makeLegend(list) {
    this.outputs = this.panel.lines.map((line, i) => {
      const item = document.createElement("button");
      item.type = "button";
      item.title = "show or hide";
      item.innerHTML = '<svg width="22" height="8"><line x1="0" x2="22" y1="4" y2="4"/></svg><span></span><output></output>';
      item.querySelector("span").textContent = line.label;
      item.querySelector("line").setAttribute("stroke-dasharray", DASHES[line.role].replaceAll("px", "").replace("solid", ""));
      item.querySelector("line").style.stroke = `var(${line.colour})`;
      item.addEventListener("click", () => {
        this.hidden.has(i) ? this.hidden.delete(i) : this.hidden.add(i);
        item.classList.toggle("off", this.hidden.has(i));
        this.draw();
      });
      list.append(item);
      return item.querySelector("output");
    });
  }

  setOnScreen(onScreen) {
    this.onScreen = onScreen;
    if (onScreen && this.stale) this.draw();
    if (onScreen) this.showTime(this.clock.time);
  }

  draw() {
    this.stale = !this.onScreen;
    if (this.stale) return;
    const [from, to] = this.clock.window;
    const lines = this.panel.lines.filter((_, i) => !this.hidden.has(i));
    const traces = lines.map((line) => this.trace(line, visible(line, from, to, this.plot.clientWidth)));
    const range = this.range(traces);
    if (this.drawn) {
      Plotly.react(this.plot, traces, this.layout(range));
    } else {
      this.drawn = true;
      Plotly.newPlot(this.plot, traces, this.layout(range), { displayModeBar: false, responsive: true, doubleClick: false });
      this.plot.on("plotly_relayout", (change) => this.onRelayout(change));
      this.plot.on("plotly_doubleclick", () => this.clock.setWindow(this.clock.begin, this.clock.end));
      this.plot.on("plotly_click", (event) => this.clock.setTime(event.points[0].x));
    }
    this.showTime(this.clock.time);
  }

  trace(line, points) {
    return {
      ...points,
      type: "scatter",
      mode: "lines",
      name: line.label,
      line: {
        color: this.colours(line.colour),
        dash: DASHES[line.role],
        width: WIDTHS[line.role],
        shape: this.panel.step ? "hv" : "linear",
        simplify: false,
      },
      hovertemplate: "%{y:.5g}",
    };
  }

  layout(range) {
    const ink = this.colours("--ink-soft");
    const axis = { color: ink, gridcolor: this.colours("--grid"), zeroline: false, linecolor: this.colours("--grid") };
    return {
      height: 172,
      margin: MARGIN,
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 11, color: ink },
      showlegend: false,
      hovermode: "x unified",
      hoverlabel: { bgcolor: this.colours("--card"), bordercolor: this.colours("--grid"), font: { color: this.colours("--ink") } },
      dragmode: "zoom",
      xaxis: { ...axis, range: [...this.clock.window], hoverformat: ".3f", ticksuffix: " s", showticksuffix: "last" },
      yaxis: { ...axis, range, fixedrange: true, exponentformat: "power", nticks: 6 },
      shapes: this.limits(range).map((y) => ({
        type: "line",
        xref: "paper",
        x0: 0,
        x1: 1,
        y0: y,
        y1: y,
        line: { color: this.colours("--limit"), width: 1, dash: "dash" },
      })),
    };
  }

  limits(range) {
    return this.panel.limits.flatMap(({ value }) => [-value, value]).filter((limit) => limit >= range[0] && limit <= range[1]);
  }

  // Range of the visible values; a short peak far beyond the others is excluded, and a note gives its value.
  range(traces) {
    const values = traces.flatMap((trace) => Array.from(trace.y)).filter(Number.isFinite).sort((a, b) => a - b);
    const unit = this.panel.unit ? ` ${this.panel.unit}` : "";
    this.note.textContent = "";
    if (!values.length) return [-1, 1];
    const part = (share) => values[Math.round(share * (values.length - 1))];
    let [low, high] = [values[0], values[values.length - 1]];
    const [calmLow, calmHigh] = [part(0.02), part(0.98)];
    const room = Math.max(calmHigh - calmLow, 1e-9 * Math.max(Math.abs(low), Math.abs(high)));
    if (high > calmHigh + 4 * room || low < calmLow - 4 * room) {
      const peak = Math.abs(high) > Math.abs(low) ? high : low;
      this.note.textContent = this.whole ? "exclude peaks from the scale" : `peak of ${shown(peak)}${unit} beyond the scale: show`;
      if (!this.whole) [low, high] = [calmLow - 0.5 * room, calmHigh + 0.5 * room];
    }
    const reach = Math.max(Math.abs(low), Math.abs(high));
    for (const { value: limit } of this.panel.limits) if (limit <= 4 * reach) [low, high] = [Math.min(low, -limit), Math.max(high, limit)];
    if (values[0] >= 0) low = Math.max(low, 0);
    const pad = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
    return [low - pad, high + pad];
  }

  onRelayout(change) {
    const [from, to] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (from !== undefined && to !== undefined) this.clock.setWindow(Number(from), Number(to));
  }

  showTime(time) {
    if (!this.onScreen) return;
    const [from, to] = this.clock.window;
    const width = this.plot.clientWidth - MARGIN.l - MARGIN.r;
    this.cursor.hidden = time < from || time > to;
    this.cursor.style.transform = `translateX(${MARGIN.l + (width * (time - from)) / (to - from || 1)}px)`;
    this.panel.lines.forEach((line, i) => {
      this.outputs[i].textContent = shown(line.values[indexAt(line.time, time)]);
    });
  }
}
