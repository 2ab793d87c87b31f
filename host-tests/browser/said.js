// State of a report in use.
(texts => ({
  ranges: [...new Set([...document.querySelectorAll('.plot .drawn')].map(drawn =>
    [drawn.parentElement.dataset.from, drawn.parentElement.dataset.to].join(' ')))],
  bars: [...new Set([...document.querySelectorAll('.strip svg')].map(bar => bar.getAttribute('viewBox')))],
  cursors: [...new Set([...document.querySelectorAll('.u-cursor-x')].map(line => line.style.transform))],
  times: [...new Set(texts('.u-legend .u-series:first-child .u-value'))],
  values: texts('.u-legend .u-series:not(.band) .u-value'),
  now: parseFloat(document.getElementById('now').textContent),
  slider: Number(document.getElementById('time').value),
  whole: document.getElementById('whole').disabled,
  states: document.querySelector('.states').textContent,
  maps: [...document.querySelectorAll('.map')].map(({ dataset }) =>
    [dataset.kind, Number(dataset.time), Number(dataset.peak)]),
}))(selector => [...document.querySelectorAll(selector)].map(found => found.textContent))
