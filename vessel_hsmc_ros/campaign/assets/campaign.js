// The page of a campaign: its diagrams, and the commands of its runs.

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
