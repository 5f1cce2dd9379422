// The numbers of the page: decompressed, reordered, and decimated for the visible time window.

async function inflate(id) {
  const text = atob(document.getElementById(id).textContent.trim());
  const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// An array of the payload; its bytes are grouped by significance.
function unpack(bytes, where) {
  const size = where.kind === "f8" ? 8 : 4;
  const raw = new Uint8Array(where.count * size);
  for (let place = 0; place < size; place += 1) {
    const from = where.at + place * where.count;
    for (let i = 0; i < where.count; i += 1) raw[i * size + place] = bytes[from + i];
  }
  return size === 8 ? new Float64Array(raw.buffer) : new Float32Array(raw.buffer);
}

// The last index whose time is not after t, 0 before all of them.
function indexAt(time, t) {
  let low = 0;
  let high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

// The points of a line between two times, at most about four per pixel: minimum and maximum of each stretch in their order.
function visible(line, from, to, pixels) {
  const { time, values } = line;
  const first = Math.max(0, indexAt(time, from));
  const last = Math.min(time.length - 1, indexAt(time, to) + 1);
  const count = last - first + 1;
  const stretch = Math.ceil(count / (2 * Math.max(pixels, 100)));
  if (stretch <= 2) return { x: time.slice(first, last + 1), y: values.slice(first, last + 1) };
  const x = [];
  const y = [];
  for (let start = first; start <= last; start += stretch) {
    const end = Math.min(start + stretch, last + 1);
    let least = start;
    let greatest = start;
    for (let i = start + 1; i < end; i += 1) {
      if (!(values[i] >= values[least])) least = Number.isNaN(values[i]) ? least : i;
      if (!(values[i] <= values[greatest])) greatest = Number.isNaN(values[i]) ? greatest : i;
    }
    for (const i of least < greatest ? [least, greatest] : [greatest, least]) {
      x.push(time[i]);
      y.push(values[i]);
    }
  }
  return { x, y };
}
