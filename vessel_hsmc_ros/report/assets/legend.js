// The legend of a diagram: its lines with their values at the slider's time, and its limits.

const KEY = '<svg width="22" height="8" aria-hidden="true"><line x1="0" x2="22" y1="4" y2="4"/></svg><span></span>';

class Legend {
  constructor(panel, list, onChange) {
    Object.assign(this, { panel, hidden: new Set() });
    this.outputs = panel.lines.map((line, i) => {
      const item = entry("button", line.label, line.dash, line.colour);
      item.type = "button";
      item.title = "show or hide";
      item.setAttribute("aria-pressed", "true");
      const output = item.appendChild(document.createElement("output"));
      item.addEventListener("click", () => {
        this.hidden.has(i) ? this.hidden.delete(i) : this.hidden.add(i);
        item.setAttribute("aria-pressed", String(!this.hidden.has(i)));
        onChange();
      });
      list.append(item);
      return output;
    });
    panel.limits.forEach(({ value, name, dash }) => {
      const item = entry("span", `${name} limit ±${quantity(value, panel.unit)}`, dash, "--limit");
      item.className = "limit";
      list.append(item);
    });
  }

  get lines() {
    return this.panel.lines.filter((_, i) => !this.hidden.has(i));
  }

  showTime(time) {
    this.panel.lines.forEach((line, i) => {
      this.outputs[i].textContent = quantity(line.values[indexAt(line.time, time)], this.panel.unit);
    });
  }
}

function entry(kind, text, dash, colour) {
  const item = document.createElement(kind);
  item.innerHTML = KEY;
  item.querySelector("span").textContent = text;
  item.querySelector("line").setAttribute("stroke-dasharray", dash.replaceAll("px", "").replace("solid", ""));
  item.querySelector("line").style.stroke = `var(${colour})`;
  return item;
}
