// The array at the instant: true pressures, and what the converters read.

const SIDE = 10;
const SVG = 'http://www.w3.org/2000/svg';

function drawing(tag, parts, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(parts)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function scale(full, unit) {
  const steps = Array.from({ length: 20 }, (_, n) =>
    drawing('rect', { x: n, y: 0, width: 1, height: 1, 'fill-opacity': (n + 0.5) / 20 }));
  const label = `Colours from 0 to ${full} ${unit}`;
  const parts = { viewBox: '0 0 20 1', preserveAspectRatio: 'none', role: 'img', 'aria-label': label };
  const ends = ['0', `${full} ${unit}`].map(textContent => made('span', { textContent }));
  return made('div', { className: 'scale' }, ends[0], drawing('svg', parts, ...steps), ends[1]);
}

// A map that follows the instant; `kind` names it in the page.
function map(kind, title, unit, times_s, frames, share, full) {
  const rows = Math.ceil((frames[0]?.length ?? 0) / SIDE);
  const cells = (frames[0] ?? []).map((_, n) =>
    // The last row on top, as everywhere.
    drawing('rect', { x: n % SIDE, y: rows - 1 - Math.floor(n / SIDE), width: 1, height: 1 }));
  const parts = { viewBox: `0 0 ${SIDE} ${rows}`, role: 'img', 'shape-rendering': 'crispEdges' };
  const picture = drawing('svg', parts, ...cells);
  const caption = made('figcaption', {});
  const heading = made('h4', { textContent: title });
  const figure = made('figure', { className: 'map' }, heading, picture, caption, scale(full, unit));
  figure.dataset.kind = kind;
  const show = () => {
    const here = placeOf(times_s, view.now_s);
    const frame = frames[here] ?? [];
    frame.forEach((value, n) => cells[n].setAttribute('fill-opacity', Math.min(1, Math.max(0, value / share / full))));
    const peak = number(Math.max(0, ...frame) / share);
    picture.setAttribute('aria-label', `${title} at ${timeText(times_s[here] ?? 0)}, at most ${peak} ${unit}`);
    caption.textContent = `${timeText(times_s[here] ?? 0)}: at most ${peak} ${unit}`;
    figure.dataset.time = times_s[here];
    figure.dataset.peak = peak;
  };
  return { figure, show };
}

const largest = frames => frames.reduce((most, frame) => Math.max(most, ...frame), 0);

// All maps of a finger; those of true pressures have one scale.
function mapsOf(finger, other) {
  const { times_s, true_dpa, codes } = finger.maps;
  const full_kpa = Math.max(10, largest(true_dpa), other ? largest(other.maps.true_dpa) : 0) / 10;
  const all = [
    map('true', 'True pressure', 'kPa', times_s, true_dpa, 10, full_kpa),
    map('codes', 'Sensed: codes less those at 0 s', 'codes', times_s, codes, 1, Math.max(16, largest(codes))),
  ];
  if (other) {
    const { times_s, true_dpa } = other.maps;
    all.push(map('over', 'True pressure, other run', 'kPa', times_s, true_dpa, 10, full_kpa));
  }
  return all;
}

const shownMaps = new Map();

function showMaps(place, finger, other) {
  const maps = mapsOf(finger, other);
  const figures = maps.map(({ figure }) => figure);
  const heading = made('h3', { textContent: 'The array at this instant' });
  place.replaceChildren(heading, made('div', { className: 'maps' }, ...figures));
  shownMaps.set(place, maps);
}

onNow.push(() => shownMaps.forEach(maps => maps.forEach(({ show }) => show())));
