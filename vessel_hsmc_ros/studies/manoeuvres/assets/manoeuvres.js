// The page of a ship's manoeuvres: its diagrams.
drawFigures(({ figures }, name) => figures[name])
  .then(() => {
    document.documentElement.dataset.ready = "";
  })
  .catch(showTrouble);
