// Draws diagrams whose traces and layouts are in the page, and whose colours are in the style sheet.

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
  const bars = narrow ? traces.map(({ colorbar, marker }) => colorbar ?? marker?.colorbar).filter(Boolean) : [];
  for (const bar of bars) Object.assign(bar, { orientation: "h", y: -0.2, yanchor: "top", title: { ...bar.title, side: "bottom" } });
  Plotly.react(
    element,
    traces,
    {
      ...layout,
      margin: { ...layout.margin, b: bars.length ? 120 : layout.margin.b },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 11, color: colours("--ink-soft") },
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)", font: { color: colours("--ink") } },
      hoverlabel: { bgcolor: colours("--card"), bordercolor: colours("--grid"), font: { color: colours("--ink") } },
      dragmode: "zoom",
    },
    { displayModeBar: false, responsive: true },
  );
}
