// Draws the complete figures of a page into their places, in the present theme; returns the content of the page, and what is
// called, with the colours, when the theme changes.
// A place names its figure by keys, such as "map 0".
async function drawFigures() {
  const content = JSON.parse(document.getElementById("content").textContent);
  const library = document.createElement("script");
  library.textContent = new TextDecoder().decode(await inflate("library"));
  document.head.append(library);
  const colours = makeColours();
  const places = [...document.querySelectorAll("[data-figure]")];
  const figureOf = (place) => place.split(" ").reduce((part, key) => part[key], content.figures);
  const drawAll = () => places.forEach((element) => draw(figureOf(element.dataset.figure), element, colours));
  drawAll();
  const redraws = [drawAll];
  listenToTheme(colours, () => redraws.forEach((redraw) => redraw()));
  return { content, places, colours, redraws };
}

function showTrouble(error) {
  document.getElementById("trouble").hidden = false;
  throw error;
}
