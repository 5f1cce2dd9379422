// Draws the diagrams of a campaign: the traces and layouts are in the page, their colours in the style sheet.

// A copy in which texts such as --limit or --run-0/0.2 are colours of the current theme.
function painted(part, colours) {
  if (typeof part === "string" && part.startsWith("--")) {
    const [name, opacity] = part.split("/");
    const colour = colours(name);
    if (!opacity) return colour;
    const [red, green, blue] = [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16));
    return `rgba(${red}, ${green}, ${blue}, ${opacity})`;
  }
  if (Array.isArray(part)) return part.map((each) => painted(each, colours));
  if (part && typeof part === "object") return Object.fromEntries(Object.entries(part).map(([key, each]) => [key, painted(each, colours)]));
  return part;
}

function draw(figure, element, colours) {
  const { traces, layout } = painted(figure, colours);
  const narrow = element.clientWidth < 480;
  if (narrow) for (const { marker } of traces) if (marker?.colorbar) Object.assign(marker.colorbar, { orientation: "h", y: -0.2, yanchor: "top", title: { ...marker.colorbar.title, side: "bottom" } });
  const bar = narrow && traces.some(({ marker }) => marker?.colorbar);
  Plotly.react(
    element,
    traces,
    {
      ...layout,
      margin: { ...layout.margin, b: bar ? 120 : layout.margin.b },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 11, color: colours("--ink-soft") },
      legend: { x: 1, xanchor: "right", y: 1, bgcolor: "rgba(0,0,0,0)", font: { color: colours("--ink") } },
      hoverlabel: { bgcolor: colours("--card"), bordercolor: colours("--grid"), font: { color: colours("--ink") } },
      dragmode: "zoom",
    },
    { displayModeBar: false, responsive: true },
  );
}

// A click on a run shows the command that runs it again.
function listenToRuns(element, command) {
  element.on("plotly_click", ({ points }) => {
    const run = points[0].customdata?.[0];
    if (!Number.isInteger(run)) return;
    document.getElementById("chosen").textContent = `${command} ${run}`;
    document.getElementById("replay").hidden = false;
  });
}

async function main() {
  const { figures, command } = JSON.parse(document.getElementById("content").textContent);
  const library = document.createElement("script");
  library.textContent = new TextDecoder().decode(await inflate("library"));
  document.head.append(library);
  const colours = makeColours();
  const places = [...document.querySelectorAll("[data-figure]")].map((element) => {
    const [section, index] = element.dataset.figure.split(" ");
    return [figures[section][Number(index)], element];
  });
  const drawAll = () => places.forEach(([figure, element]) => draw(figure, element, colours));
  drawAll();
  places.forEach(([, element]) => listenToRuns(element, command));
  listenToTheme(colours, drawAll);
  document.getElementById("copy").addEventListener("click", () => navigator.clipboard?.writeText(document.getElementById("chosen").textContent));
  document.documentElement.dataset.ready = "";
}

main().catch((error) => {
  document.getElementById("trouble").hidden = false;
  throw error;
});
