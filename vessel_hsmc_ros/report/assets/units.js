// Numbers as people write them, by the rule of core/quantities.py: three significant digits, units with SI prefixes.

const GREATER = [[1e9, "G"], [1e6, "M"], [1e3, "k"]];
const SMALLER = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
const PREFIXES = { N: [...GREATER, ...SMALLER], "N·m": [...GREATER, ...SMALLER], m: [[1e3, "k"], ...SMALLER] };
for (const unit of ["s", "m/s", "m/s²", "rad/s", "rad/s²"]) PREFIXES[unit] = SMALLER;
const CLOSE = ["°", "°/s"]; // follow their number without a space

// The factor that converts SI values of some size, and the unit with its prefix.
function scaled(value, unit) {
  const size = Math.abs(Number(value.toPrecision(3)));
  const fits = ([scale]) => (scale > 1 ? scale : 0.1 * scale) * (1 - 1e-9) <= size && size < 1e6 * scale;
  const [scale, prefix] = (PREFIXES[unit] ?? []).find(fits) ?? [1, ""];
  return [1 / scale, prefix + unit];
}

function number(value) {
  const rounded = Math.abs(value) < 1000 ? Number(value.toPrecision(3)) : value;
  const size = Math.abs(rounded);
  if (size >= 1000 && size < 1e6) return rounded.toFixed(0);
  const [digits, power] = rounded.toExponential(2).split("e");
  if (size === 0 || (power >= -4 && power < 3)) return String(Number(rounded.toPrecision(3)));
  return `${Number(digits)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

function quantity(value, unit) {
  if (value === undefined || !Number.isFinite(value)) return "–";
  const [factor, prefixed] = scaled(value, unit);
  return number(value * factor) + (CLOSE.includes(prefixed) ? prefixed : ` ${prefixed}`).trimEnd();
}

// The unit of an axis that reaches up to a value: [factor, label]. Units without prefixes get a power of ten where it is needed.
function axisUnit(reach, unit) {
  if (unit in PREFIXES) return scaled(reach, unit);
  if (reach === 0 || (reach >= 1e-3 && reach < 1e5)) return [1, unit];
  const power = 3 * Math.floor(Math.log10(reach) / 3);
  const raised = [...String(power)].map((digit) => (digit === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit])).join("");
  return [10 ** -power, `10${raised} ${unit}`.trimEnd()];
}

// The unit of a time axis by its length: [factor, label].
function timeUnit(span) {
  if (span > 4 * 3600) return [1 / 3600, "h"];
  return span > 600 ? [1 / 60, "min"] : [1, "s"];
}

// A point of time, as the slider and the events show it; minutes in runs that are long.
function moment(time, end, digits = 2) {
  if (end <= 600) return `${time.toFixed(digits)} s`;
  const minutes = Math.floor(time / 60 + 1e-9);
  return `${minutes} min ${Math.max(0, time - 60 * minutes).toFixed(digits).padStart(3 + digits, "0")} s`;
}

// The smallest step of 1, 2 or 5 times a power of ten that is not below a size.
function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least * (1 - 1e-9));
}

// Labelled places on an axis between two values, at most about `most`; the labels are in the unit that a factor converts to.
function ticks(from, to, most, factor) {
  const step = niceStep((factor * (to - from)) / most || 1);
  const places = [];
  for (let n = Math.ceil((factor * from) / step - 1e-9); n * step <= factor * to * (1 + 1e-12) + 1e-9 * step; n += 1) places.push(n * step);
  const digits = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return { places: places.map((place) => place / factor), texts: places.map((place) => place.toFixed(digits).replace(/^-(?=0\.?0*$)/, "").replace("-", "−")) };
}
