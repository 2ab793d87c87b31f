// What a report says of itself.
(() => {
  const shown = element => { const r = element.getBoundingClientRect(); return r.width > 0 && r.height > 0; };
  const all = selector => [...document.querySelectorAll(selector)];
  // A grid alone paints some hundred dots in each of its lines; a canvas that nothing was drawn on none.
  const painted = canvas => {
    const dots = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    return dots.reduce((sum, part, n) => sum + (n % 4 === 3 && part > 0), 0) > 1000;
  };
  const scale = svg => svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  const letters = all('.plot svg').filter(shown).flatMap(svg =>
    [...svg.querySelectorAll('text')].map(text => parseFloat(getComputedStyle(text).fontSize) * scale(svg)));
  const outside = all('.plot svg').filter(shown).flatMap(svg => {
    const box = svg.getBoundingClientRect();
    return [...svg.querySelectorAll('text')].filter(text => {
      const r = text.getBoundingClientRect();
      return r.left < box.left - 1 || r.right > box.right + 1 || r.top < box.top - 1 || r.bottom > box.bottom + 1;
    }).map(text => text.textContent.trim());
  });
  return {
    title: document.title,
    letters: document.body.innerText.length,
    simulated: document.body.innerText.includes('Simulated'),
    sections: all('section').filter(shown).map(section => section.id),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    plots: all('.plot .still svg').filter(shown).length,
    lines: all('.plot .still svg polyline').length,
    charts: all('.plot .drawn canvas').filter(shown).filter(painted).length,
    bars: all('.strip svg').filter(shown).length,
    controls: all('#player, #choose').filter(shown).length,
    maps: all('.maps figure').filter(shown).length,
    scales: all('.scale').filter(shown).length,
    cut: all('#bounds .scroll, #ledger .scroll').filter(table => table.scrollWidth > table.clientWidth).length,
    nameless: all('[role=img]').filter(image => !image.getAttribute('aria-label')).length,
    smallest_px: letters.length ? Math.min(...letters) : 0,
    outside: outside,
    page: getComputedStyle(document.body).backgroundColor,
    text: getComputedStyle(document.body).color,
  };
})()
