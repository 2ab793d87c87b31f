// The controls, and what is drawn at first.

const PLAY_S = 10;
const TICKS = 1000;
const [play, time, now, whole] = ['play', 'time', 'now', 'whole'].map(element);
let before_ms = null;

const playing = () => before_ms != null;

function stop() {
  before_ms = null;
  play.textContent = 'Play';
}

function tick(ms) {
  if (!playing()) return;
  const next_s = view.now_s + (view.to_s - view.from_s) * (ms - before_ms) / 1000 / PLAY_S;
  before_ms = ms;
  setNow(next_s);
  if (next_s >= view.to_s) stop(); else requestAnimationFrame(tick);
}

play.addEventListener('click', () => {
  if (playing()) { stop(); return; }
  if (view.now_s >= view.to_s) setNow(view.from_s);
  play.textContent = 'Stop';
  requestAnimationFrame(ms => { before_ms = ms; tick(ms); });
});
time.addEventListener('input', () => { stop(); setNow(view.from_s + (view.to_s - view.from_s) * time.value / TICKS); });
whole.addEventListener('click', () => setRange(0, end_s));
onNow.push(() => {
  time.value = Math.round(TICKS * (view.now_s - view.from_s) / (view.to_s - view.from_s));
  now.textContent = timeText(view.now_s);
  time.setAttribute('aria-valuetext', now.textContent);
});
onRange.push(() => { whole.disabled = view.from_s <= 0 && view.to_s >= end_s; });

function drawAll(other) {
  drawn.splice(0).forEach(chart => chart.destroy());
  document.querySelectorAll('.finger').forEach(place => {
    const number = Number(place.dataset.finger);
    const [finger, twin] = [run.fingers[number], other?.fingers[number]];
    for (const plot of finger.plots) {
      const figure = [...place.querySelectorAll('.plot')].find(figure => figure.dataset.title === plot.title);
      draw(figure, finger, plot, twin);
    }
    showMaps(place.querySelector('.array'), finger, twin);
  });
  setNow(view.now_s);
}

element('other').addEventListener('change', async ({ target }) => {
  const [file] = target.files;
  if (!file) return;
  try {
    lay(runOf(await file.text()));
  } catch (error) {
    lay(null);
    element('over-note').textContent = `${file.name}: ${error.message}`;
  }
  target.value = '';
});
element('alone').addEventListener('click', () => lay(null));

document.querySelectorAll('.finger').forEach(place =>
  strips(place.querySelector('[data-title=strip]'), run.fingers[Number(place.dataset.finger)]));
element('player').hidden = element('choose').hidden = false;
const embedded = element('over');
lay(embedded && JSON.parse(embedded.textContent));
setRange(0, end_s);
// At the instant of the largest force on the array there is something to see.
const { times_s, true_dpa } = run.fingers[0].maps;
const sums = true_dpa.map(frame => frame.reduce((sum, value) => sum + value, 0));
setNow(times_s[sums.indexOf(Math.max(...sums))] ?? 0);
new ResizeObserver(() => drawn.forEach(chart => {
  const width = chart.root.closest('.plot').clientWidth;
  if (width !== chart.width) chart.setSize({ width, height: HEIGHT_PX });
})).observe(document.querySelector('main'));
const dark = matchMedia('(prefers-color-scheme: dark)');
dark.addEventListener('change', () => drawn.forEach(chart => chart.redraw(false)));
document.documentElement.dataset.ready = 'true';
