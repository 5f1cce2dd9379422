// A page without diagrams.
listenToTheme(makeColours(), () => {});
document.documentElement.dataset.ready = "";
