// Another report's run over this one: the page brings one, or its reader chooses a file.

const FORMAT = 1;

// The run in a report's text. Nothing of that page is run.
function runOf(text) {
  const data = new DOMParser().parseFromString(text, 'text/html').getElementById('run');
  if (!data) throw new Error('this is no report of a run');
  const found = JSON.parse(data.textContent);
  if (found.format !== FORMAT) throw new Error(`its data are of format ${found.format}, ${FORMAT} is asked for`);
  return found;
}

// Its metrics beside this run's.
function showMetrics(other) {
  document.querySelectorAll('.other-value').forEach(old => old.remove());
  if (!other) return;
  const add = (row, tag, textContent) =>
    row.querySelector('.about').before(made(tag, { className: 'number other-value', textContent }));
  document.querySelectorAll('#metrics thead tr').forEach(row => add(row, 'th', 'other run'));
  document.querySelectorAll('[data-metric]').forEach(row => add(row, 'td', number(other.metrics[row.dataset.metric])));
}

function lay(other) {
  const note = element('over-note');
  const { scene, seed, board, digest } = other ?? {};
  note.textContent = other ? `Dotted: the run ${scene}, seed ${seed}, board ${board}, digest ${digest}.` : '';
  element('alone').hidden = !other;
  showMetrics(other);
  drawAll(other);
}
