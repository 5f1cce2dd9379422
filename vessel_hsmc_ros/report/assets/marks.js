// Events of the runs: as lines with flags on the diagrams, and as a list whose entries move the slider there.

const FLAG = 20; // events closer than this many pixels share a flag
const LISTED = 6; // events that the label of a flag names

class MarkLayer {
  constructor(frame, marks, margin, clock) {
    Object.assign(this, { marks, clock, all: marks.map((mark, i) => ({ ...mark, i })).sort((a, b) => a.t - b.t) });
    this.layer = frame.appendChild(document.createElement("div"));
    this.layer.className = "marks";
    this.layer.style.inset = `0 ${margin.r}px ${margin.b}px ${margin.l}px`;
  }

  // Draw the events of the visible window.
  draw(width) {
    const [from, to] = this.clock.window;
    const groups = [];
    for (const mark of this.all) {
      if (mark.t < from || mark.t > to) continue;
      const share = (mark.t - from) / (to - from);
      const last = groups[groups.length - 1];
      if (last && (share - last.share) * width < FLAG) last.marks.push(mark);
      else groups.push({ share, marks: [mark] });
    }
    this.layer.replaceChildren(...groups.flatMap((group) => this.elements(group, from, to)));
  }

  elements({ share, marks }, from, to) {
    const lines = marks.map((mark) => {
      const line = document.createElement("i");
      line.style.left = `${(100 * (mark.t - from)) / (to - from)}%`;
      line.style.borderColor = `var(${mark.colour})`;
      return line;
    });
    const flag = document.createElement("button");
    const texts = marks.slice(0, LISTED).map((mark) => `${moment(mark.t, this.clock.end, 1)} · ${mark.label}`);
    if (marks.length > LISTED) texts.push(`and ${marks.length - LISTED} more`);
    Object.assign(flag, { type: "button", className: "flag", tabIndex: -1, textContent: marks.length > 1 ? marks.length : "" });
    flag.setAttribute("aria-label", texts.join("; "));
    flag.dataset.marks = marks.map((mark) => mark.i).join(" ");
    flag.style.left = `${100 * share}%`;
    const one = marks.every((mark) => mark.colour === marks[0].colour);
    flag.style.background = `var(${one ? marks[0].colour : "--ink-soft"})`;
    flag.addEventListener("click", () => this.clock.setTime(marks[0].t));
    const label = document.createElement("div");
    label.className = "label";
    label.textContent = texts.join("\n");
    // Away from the nearer edge, so that the label lies within the diagram.
    Object.assign(label.style, share <= 0.5 ? { left: `${100 * share}%`, maxWidth: `${100 * (1 - share)}%` } : { right: `${100 * (1 - share)}%`, maxWidth: `${100 * share}%` });
    return [...lines, flag, label];
  }
}

// The list of events: a click moves the slider there, hovering or focusing an entry shows its label on the diagrams.
function listenToEvents(marks, clock) {
  for (const entry of document.querySelectorAll("#events [data-mark]")) {
    const { t } = marks[Number(entry.dataset.mark)];
    const show = (active) => {
      for (const flag of document.querySelectorAll(".flag")) {
        flag.classList.toggle("active", active && flag.dataset.marks.split(" ").includes(entry.dataset.mark));
      }
    };
    entry.querySelector("time").textContent = moment(t, clock.end, 1);
    entry.addEventListener("click", () => {
      if (t < clock.window[0] || t > clock.window[1]) clock.setWindow(clock.begin, clock.end);
      clock.setTime(t);
      show(true);
    });
    for (const event of ["pointerenter", "focus"]) entry.addEventListener(event, () => show(true));
    for (const event of ["pointerleave", "blur"]) entry.addEventListener(event, () => show(false));
  }
}
