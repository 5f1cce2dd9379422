// The page of a ship's manoeuvres: its diagrams.

async function main() {
  const { figures } = JSON.parse(document.getElementById("content").textContent);
  const library = document.createElement("script");
  library.textContent = new TextDecoder().decode(await inflate("library"));
  document.head.append(library);
  const colours = makeColours();
  const places = [...document.querySelectorAll("[data-figure]")];
  const drawAll = () => places.forEach((element) => draw(figures[element.dataset.figure], element, colours));
  drawAll();
  listenToTheme(colours, drawAll);
  document.documentElement.dataset.ready = "";
}

main().catch((error) => {
  document.getElementById("trouble").hidden = false;
  throw error;
});
