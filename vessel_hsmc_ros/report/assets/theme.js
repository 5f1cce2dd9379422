// The colours of the style sheet in the current theme.
function makeColours() {
  let known = {};
  const colours = (name) => (known[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  colours.forget = () => (known = {});
  return colours;
}

function listenToTheme(colours, redraw) {
  const button = document.getElementById("theme");
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const changed = () => {
    colours.forget();
    redraw();
  };
  button.addEventListener("click", () => {
    const now = document.documentElement.dataset.theme ?? (dark.matches ? "dark" : "light");
    document.documentElement.dataset.theme = now === "dark" ? "light" : "dark";
    changed();
  });
  dark.addEventListener("change", changed);
}
