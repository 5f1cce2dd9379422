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

drawFigures()
  .then(({ content, places }) => {
    places.forEach((element) => listenToRuns(element, content.command));
    document.getElementById("copy").addEventListener("click", () => navigator.clipboard?.writeText(document.getElementById("chosen").textContent));
    document.documentElement.dataset.ready = "";
  })
  .catch(showTrouble);
