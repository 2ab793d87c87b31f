// The plots, drawn by uPlot. All show the same range of time and the same instant.

const HEIGHT_PX = 230;
// The bars of modes, faults and limits lie as far in from the sides as these.
const LEFT_PX = 56;
const RIGHT_PX = 12;
const FONT = '12px system-ui, sans-serif';
const POINTER = ['mousedown', 'mouseup', 'click', 'dblclick', 'mousemove', 'mouseleave', 'mouseenter'];
const drawn = [];

// Around all values with a little air; 0 is in sight where it is not far.
function around(low, high) {
  if (low == null || high == null) return [0, 1];
  const near = value => Math.abs(value) < 2 * (high - low);
  const [from, to] = [low > 0 && near(low) ? 0 : low, high < 0 && near(high) ? 0 : high];
  const air = Math.max(0.06 * (to - from), 1e-3 * Math.abs(high), 1e-6);
  return [from === 0 ? 0 : from - air, to === 0 ? air : to + air];
}

// A line's values at other times, straight between its own; none outside.
function at(times_s, values, others_s) {
  return others_s.map(time_s => {
    if (time_s < times_s[0] || time_s > times_s.at(-1)) return null;
    const here = placeOf(times_s, time_s);
    const [from, to] = [values[here], values[here + 1] ?? values[here]];
    if (from == null || to == null) return null;
    const wide_s = (times_s[here + 1] ?? time_s) - times_s[here];
    return wide_s > 0 ? from + (to - from) * (time_s - times_s[here]) / wide_s : from;
  });
}

const LINES = {
  main: { stroke: () => colour('--ink'), width: 2 },
  second: { stroke: () => colour('--second'), width: 1 },
  goal: { stroke: () => colour('--goal'), width: 2, dash: [7, 4], paths: uPlot.paths.stepped({ align: 1 }) },
  over: { stroke: () => colour('--over'), width: 1.5, dash: [2, 2] },
};

// Columns and series of a plot, of this run and of the other one.
function contents(finger, plot, other) {
  const twin = other?.plots.find(known => known.title === plot.title);
  const { times_s } = finger;
  const [columns, bands] = [[times_s], []];
  const series = [{ label: 'time', value: (_, value) => value == null ? '' : timeText(value) }];
  const hidden = { stroke: 'transparent', width: 0, points: { show: false }, class: 'band' };
  for (const line of plot.lines) {
    const value = (_, value, __, index) => {
      if (value == null) return '';
      const [low, high] = [line.low?.[index], line.high?.[index]];
      return `${number(value)} ${plot.unit}${low == null ? '' : ` (${number(low)} to ${number(high)})`}`;
    };
    if (line.low) {
      const high = series.length;
      series.push({ ...hidden, label: 'largest' }, { ...hidden, label: 'least' });
      columns.push(line.high, line.low);
      bands.push({ series: [high, high + 1], fill: () => colour('--pale') });
    }
    series.push({ label: line.label, value, points: { show: false }, ...LINES[line.style] });
    columns.push(line.mean);
  }
  if (twin) {
    const value = (_, value) => value == null ? '' : `${number(value)} ${plot.unit}`;
    series.push({ label: `${twin.lines[0].label}, other run`, value, points: { show: false }, ...LINES.over });
    columns.push(at(other.times_s, twin.lines[0].mean, times_s));
  }
  return { columns, series, bands };
}

function axis(parts) {
  const grid = { stroke: () => colour('--line'), width: 1 };
  return { stroke: () => colour('--soft'), grid, ticks: grid, font: FONT, ...parts };
}

function draw(figure, finger, plot, other) {
  const { columns, series, bands } = contents(finger, plot, other);
  const still = () => null;
  const here = made('div', { className: 'drawn' });
  here.setAttribute('role', 'img');
  here.setAttribute('aria-label', `${plot.about}, over time in s`);
  const options = {
    title: `${plot.title}, ${plot.unit}`,
    width: figure.clientWidth,
    height: HEIGHT_PX,
    padding: [8, RIGHT_PX, 0, 0],
    scales: {
      x: { time: false, range: () => [view.from_s, view.to_s] },
      // Of the whole run, what the finger held is shown large; a part of it whole.
      y: { range: (_, low, high) => whole.disabled && plot.range || around(low, high) },
    },
    axes: [axis({ label: 'time, s', labelSize: 18, size: 34, labelFont: FONT }), axis({ size: LEFT_PX })],
    series,
    bands,
    legend: { markers: { dash: (_, n) => ({ 7: 'dashed', 2: 'dotted' })[series[n].dash?.[0]] ?? 'solid' } },
    // Where the cursor is, all plots are told by the view; what a pointer does is told to it by `handle`.
    cursor: {
      y: false,
      drag: { setScale: false, x: false, y: false },
      bind: Object.fromEntries(POINTER.map(name => [name, still])),
    },
    hooks: {
      setScale: [(chart, key) => {
        if (key !== 'x') return;
        [figure.dataset.from, figure.dataset.to] = [chart.scales.x.min, chart.scales.x.max];
        point(chart);
      }],
    },
  };
  const chart = new uPlot(options, columns, here);
  figure.querySelector('.drawn')?.remove();
  figure.prepend(here);
  handle(chart);
  drawn.push(chart);
}

function point(chart) {
  chart.setCursor({ left: chart.valToPos(view.now_s, 'x'), top: 0 }, false);
}

// A drag zooms, a second click shows the whole run, a touch or a mouse that passes sets the instant.
function handle(chart) {
  const SLACK_PX = 6;
  let from_px = null;
  const place = event => event.clientX - chart.over.getBoundingClientRect().left;
  const time = px => chart.posToVal(Math.min(Math.max(px, 0), chart.over.clientWidth), 'x');
  const select = (left, width) => {
    const height = width > 0 ? chart.over.clientHeight : 0;
    chart.setSelect({ left, width, top: 0, height }, false);
  };
  const events = {
    pointerdown: event => {
      if (event.button !== 0) return;
      from_px = place(event);
      chart.over.setPointerCapture(event.pointerId);
    },
    pointermove: event => {
      const px = place(event);
      if (from_px == null) { if (!playing()) setNow(time(px)); return; }
      const wide = Math.abs(px - from_px);
      select(Math.min(px, from_px), wide > SLACK_PX ? wide : 0);
    },
    pointerup: event => {
      if (from_px == null) return;
      const ends = [from_px, place(event)].sort((a, b) => a - b);
      from_px = null;
      select(0, 0);
      if (ends[1] - ends[0] > SLACK_PX) setRange(time(ends[0]), time(ends[1]));
      else setNow(time(ends[0]));
    },
    // The page is scrolled instead.
    pointercancel: () => { from_px = null; select(0, 0); },
    dblclick: () => setRange(0, end_s),
  };
  for (const [name, listener] of Object.entries(events)) chart.over.addEventListener(name, listener);
}

onRange.push(() => drawn.forEach(chart => chart.setScale('x', { min: view.from_s, max: view.to_s })));
onNow.push(() => drawn.forEach(point));

// The bars are pictures of the page: zoomed by what of them is shown.
const WIDE = 1000;

function strips(figure, finger) {
  const last_s = Math.max(finger.times_s.at(-1) ?? 0, 1e-9);
  figure.querySelector('.strip > .note').remove();
  const pictures = [...figure.querySelectorAll('svg')];
  const states = made('p', { className: 'note states' });
  figure.append(states);
  const lines = pictures.map(picture => {
    const line = made('div', { className: 'now' });
    picture.after(line);
    return line;
  });
  const range = () => {
    const [from, wide] = [view.from_s, view.to_s - view.from_s].map(time_s => WIDE * time_s / last_s);
    pictures.forEach(picture => picture.setAttribute('viewBox', `${from} 0 ${wide} 10`));
  };
  const now = () => {
    const share = (view.now_s - view.from_s) / (view.to_s - view.from_s);
    lines.forEach(line => line.style.setProperty('--share', share));
    const here = placeOf(finger.times_s, view.now_s);
    const holds = finger.strip.filter(row => row.spans.some(([from, to]) => from <= here && here < to));
    states.textContent = `At ${timeText(view.now_s)}: ${holds.map(row => `${row.kind} ${row.name}`).join(', ')}`;
  };
  onRange.push(range);
  onNow.push(now);
}
