// A page whose diagrams need nothing but to be drawn.
drawFigures()
  .then(() => {
    document.documentElement.dataset.ready = "";
  })
  .catch(showTrouble);
