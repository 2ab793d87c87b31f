// What is shown of the run: a range of time and an instant in it. Whoever shows something of it is told of each change.

const element = id => document.getElementById(id);
const run = JSON.parse(element('run').textContent);
const end_s = Math.max(1e-3, ...run.fingers.map(finger => finger.times_s.at(-1) ?? 0));
const view = { from_s: 0, to_s: end_s, now_s: 0 };
const onRange = [];
const onNow = [];

function setNow(time_s) {
  view.now_s = Math.min(Math.max(time_s, view.from_s), view.to_s);
  onNow.forEach(show => show());
}

// A range of less than a few stretches shows nothing more.
function setRange(from_s, to_s) {
  const least_s = end_s / 200;
  const middle_s = Math.min(Math.max((from_s + to_s) / 2, least_s / 2), end_s - least_s / 2);
  const half_s = Math.max(to_s - from_s, least_s) / 2;
  view.from_s = Math.max(0, middle_s - half_s);
  view.to_s = Math.min(end_s, middle_s + half_s);
  onRange.forEach(show => show());
  setNow(view.now_s);
}

// The last place whose time is not later; the first where there is none.
function placeOf(times_s, time_s) {
  let [low, high] = [0, times_s.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times_s[middle] <= time_s) low = middle; else high = middle;
  }
  return low;
}

const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function number(value) {
  if (value == null) return 'none';
  return String(Number(value.toPrecision(4)));
}

// To a thousandth of what is shown, so that the last digit moves.
function timeText(time_s) {
  const digits = Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(view.to_s - view.from_s))));
  return `${time_s.toFixed(digits)} s`;
}

function made(tag, parts, ...children) {
  const made = Object.assign(document.createElement(tag), parts);
  made.append(...children);
  return made;
}
