// What a report says of itself.
(() => {
  const shown = element => { const r = element.getBoundingClientRect(); return r.width > 0 && r.height > 0; };
  const all = selector => [...document.querySelectorAll(selector)];
  // A grid alone paints some hundred dots in each of its lines; a canvas that nothing was drawn on none.
  const painted = canvas => {
    const dots = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    return dots.reduce((sum, part, n) => sum + (n % 4 === 3 && part > 0), 0) > 1000;
  };
  return {
    title: document.title,
    letters: document.body.innerText.length,
    simulated: document.body.innerText.includes('Simulated'),
    sections: all('section').filter(shown).map(section => section.id),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    charts: all('.plot .drawn canvas').filter(shown).filter(painted).length,
    bars: all('.strip svg').filter(shown).length,
    note: document.body.innerText.includes('need a script'),
    controls: all('#player, #choose').filter(shown).length,
    maps: all('.maps figure').filter(shown).length,
    scales: all('.scale').filter(shown).length,
    cut: all('#bounds .scroll, #ledger .scroll').filter(table => table.scrollWidth > table.clientWidth).length,
    nameless: all('[role=img]').filter(image => !image.getAttribute('aria-label')).length,
    page: getComputedStyle(document.body).backgroundColor,
    text: getComputedStyle(document.body).color,
  };
})()
