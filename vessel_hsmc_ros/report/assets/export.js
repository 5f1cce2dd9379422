// Exports: the data and the picture of a diagram, the picture of the map.

function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${document.title} ${name}`.replace(/[^\p{L}\p{N}.=-]+/gu, "_");
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// The shortest text that reads back as the same 32-bit number.
function shortest(value) {
  if (!Number.isFinite(value)) return "";
  for (let digits = 6; digits < 9; digits += 1) {
    const text = String(Number(value.toPrecision(digits)));
    if (Math.fround(Number(text)) === value) return text;
  }
  return String(Number(value.toPrecision(9)));
}

// The shown lines within the visible window as CSV in SI units; a cell is empty where a line has no sample at that time.
function csvOf(panel, lines, [from, to]) {
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const unit = panel.unit ? ` [${panel.unit}]` : "";
  const at = lines.map((line) => indexAt(line.time, from) + (line.time[indexAt(line.time, from)] < from ? 1 : 0));
  const rows = [["time [s]", ...lines.map((line) => quoted(line.label + unit))].join(",")];
  for (;;) {
    const time = Math.min(...lines.map((line, i) => line.time[at[i]] ?? Infinity));
    if (!(time <= to)) return `${rows.join("\n")}\n`;
    rows.push([time, ...lines.map((line, i) => (line.time[at[i]] === time ? shortest(line.values[at[i]++]) : ""))].join(","));
  }
}

// The picture of a diagram with its title, its legend and the events, as a blob.
async function pictureOf(chart, format) {
  const { traces, layout } = chart.figure();
  const ink = chart.colours("--ink");
  const [from, to] = chart.clock.window;
  const within = chart.marks.all.filter((mark) => mark.t >= from && mark.t <= to);
  const lines = within.map(({ t, colour }) => ({
    type: "line", x0: t, x1: t, yref: "paper", y0: 0, y1: 1, line: { color: chart.colours(colour), width: 1, dash: "dot" },
  }));
  const labels = within.map(({ t, kind }) => ({
    x: t, yref: "paper", y: 1, xanchor: "left", yanchor: "top", text: kind, textangle: 90, showarrow: false, font: { size: 9 },
  }));
  const picture = {
    ...layout,
    width: 900,
    height: 380,
    margin: { l: 64, r: 20, t: 70, b: 48 },
    paper_bgcolor: chart.colours("--card"),
    title: { text: `${chart.panel.title} ${chart.unit.textContent}`.trim(), x: 0.02, xanchor: "left", font: { size: 15, color: ink } },
    showlegend: true,
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    shapes: [...layout.shapes, ...lines],
    annotations: [...layout.annotations, ...labels],
  };
  const address = await Plotly.toImage({ data: traces, layout: picture }, { format, width: 900, height: 380, scale: 2 });
  const [head, body] = [address.slice(0, address.indexOf(",")), address.slice(address.indexOf(",") + 1)];
  if (format === "svg") return new Blob([decodeURIComponent(body)], { type: "image/svg+xml" });
  return new Blob([Uint8Array.from(atob(body), (character) => character.charCodeAt(0))], { type: head.slice(5, head.indexOf(";")) });
}

const EXPORTS = {
  csv: (chart) => new Blob([csvOf(chart.panel, chart.legend.lines, chart.clock.window)], { type: "text/csv" }),
  png: (chart) => pictureOf(chart, "png"),
  svg: (chart) => pictureOf(chart, "svg"),
};

// The buttons of a diagram: its help text and its exports.
function listenToTools(chart) {
  const [help, text] = [chart.element.querySelector(".ask"), chart.element.querySelector(".help")];
  help?.addEventListener("click", () => {
    text.hidden = !text.hidden;
    help.setAttribute("aria-expanded", String(!text.hidden));
  });
  for (const button of chart.element.querySelectorAll("[data-export]")) {
    const format = button.dataset.export;
    button.addEventListener("click", async () => {
      button.closest("details").open = false;
      save(`${chart.panel.title}.${format}`, await EXPORTS[format](chart));
    });
  }
}

// Menus close on Escape and on a click elsewhere.
function listenToMenus() {
  const close = (but) => document.querySelectorAll(".menu[open]").forEach((menu) => menu !== but && (menu.open = false));
  document.addEventListener("click", (event) => close(event.target.closest(".menu")));
  document.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    document.querySelector(".menu[open] summary")?.focus();
    close(null);
  });
}
