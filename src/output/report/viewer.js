'use strict';
(() => {
  const run = JSON.parse(document.getElementById('run').textContent);
  const sources = document.querySelectorAll('script.frame');
  const $ = id => document.getElementById(id);
  if (!sources.length || !$('viewer')) return;

  // ---- frames are parsed when they are first shown -------------------------
  const parsed = [];
  const frame = i => parsed[i] || (parsed[i] = JSON.parse(sources[i].textContent));

  const VIEWS = [
    { key: 'left', name: 'Left image', note: 'as processed', cls: '' },
    { key: 'saliency', name: 'Saliency', note: 'attention S', cls: 'sal' },
    { key: 'roi', name: 'Region of interest', note: 'what is matched', cls: '' },
    { key: 'disparity', name: 'Disparity', note: 'pixels', cls: 'dim exact' },
    { key: 'depth', name: 'Depth', note: 'metres', cls: 'dim exact' },
    { key: 'regions', name: 'Regions', note: 'id, distance, confidence', cls: '' },
  ];
  let now = 0, view = 5, timer = null, lit = null;

  const el = (name, attributes, ...children) => {
    const node = document.createElement(name);
    for (const [k, v] of Object.entries(attributes || {})) node.setAttribute(k, v);
    node.append(...children);
    return node;
  };
  const svg = (name, attributes) => {
    const node = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const [k, v] of Object.entries(attributes)) node.setAttribute(k, v);
    return node;
  };
  const known = v => v !== null && v !== undefined;
  const digits = v => v.toFixed(v < 1 ? 2 : v < 10 ? 1 : 0);
  const metres = v => known(v) ? v.toFixed(v < 10 ? 2 : 1) + ' m' : '–';

  // ---- one view --------------------------------------------------------------
  const layerOf = (f, key) => f.layers[key] || '';
  function paint(box, f, which) {
    const { key, cls } = VIEWS[which];
    box.className = 'view ' + cls;
    box.style.setProperty('--ar', f.width + '/' + f.height);
    const [base, layer, marks] = box.children;
    if (base.src !== f.left) base.src = f.left;
    const source = layerOf(f, key);
    if (source) { if (layer.src !== source) layer.src = source; } else layer.removeAttribute('src');
    marks.replaceChildren();
    marks.setAttribute('viewBox', `0 0 ${f.width} ${f.height}`);
    if (key === 'regions') outline(marks, f, box);
  }

  function outline(marks, f, box) {
    // Letters keep their size on the screen whatever the size of the image.
    const shown = box.clientWidth || 600;
    const s = f.width / shown;
    const plates = [];
    const groups = f.regions.map(r => {
      const g = svg('g', { 'data-id': r.key, class: r.state === 'coasted' ? 'coasted' : '' });
      if (r.contour.length) {
        const d = 'M' + r.contour.map(p => p.join(' ')).join('L') + 'Z';
        g.append(svg('path', { d, fill: r.color, stroke: r.color }));
      }
      const [x, y, w, h] = r.box;
      g.append(svg('rect', { class: 'box', x, y, width: w, height: h, stroke: r.color }));
      marks.append(g);
      return g;
    });
    f.regions.forEach((r, i) => {
      const text = [r.name, known(r.distance) ? metres(r.distance) : null, known(r.confidence) ? Math.round(r.confidence * 100) + '%' : null].filter(known).join('  ');
      const size = shown < 500 ? 10 : 13;
      const wide = (text.length * size * 0.56 + 10) * s, high = (size + 7) * s;
      const [x, y, w, h] = r.box;
      const left = Math.max(0, Math.min(x, f.width - wide));
      const fits = top => top >= 0 && top + high <= f.height && !plates.some(p => left < p[0] + p[2] && p[0] < left + wide && top < p[1] + high && p[1] < top + high);
      const top = [y - high, y + h, y, y - 2.1 * high, y + h - high].find(fits);
      if (top === undefined) return;
      plates.push([left, top, wide]);
      const plate = svg('rect', { class: 'plate', x: left, y: top, width: wide, height: high, fill: r.color });
      const label = svg('text', { x: left + 5 * s, y: top + high - 5.5 * s, 'font-size': size * s });
      label.textContent = text;
      groups[i].append(plate, label);
    });
    glow();
  }

  // ---- hovering a region, here or in the table --------------------------------
  function glow() {
    for (const g of document.querySelectorAll('.marks g')) {
      g.classList.toggle('lit', lit !== null && g.dataset.id === lit);
      g.classList.toggle('faint', lit !== null && g.dataset.id !== lit);
    }
    for (const tr of document.querySelectorAll('#regions tbody tr')) tr.classList.toggle('lit', lit !== null && tr.dataset.id === lit);
  }
  const light = id => { if (id !== lit) { lit = id; glow(); } };

  // ---- table --------------------------------------------------------------------
  function list(f) {
    const body = document.querySelector('#regions tbody');
    body.replaceChildren();
    $('regionscaption').textContent = f.regions.length === 1 ? '1 region' : f.regions.length + ' regions';
    if (!f.regions.length) {
      body.append(el('tr', { class: 'none' }, el('td', { colspan: 7 }, f.rejected ? `None: ${f.rejected} candidates were refused.` : 'None in this frame.')));
    }
    for (const r of f.regions) {
      const id = el('td', {}, el('span', { class: 'swatch', style: '--c:' + r.color }), r.name);
      if (r.state) id.append(el('span', { class: 'state' }, r.state));
      const spread = known(r.deviation) ? ' ± ' + r.deviation.toFixed(r.deviation < 1 ? 2 : 1) : '';
      const meter = el('td', { class: 'n' });
      if (known(r.confidence)) meter.append(el('span', { class: 'meter', style: `--v:${r.confidence};--c:${r.color}` }), Math.round(r.confidence * 100) + '%'); else meter.append('–');
      const row = el('tr', { 'data-id': r.key }, id,
        el('td', { class: 'n' }, metres(r.distance) + spread),
        meter,
        el('td', { class: 'n opt' }, r.size ? r.size.map(digits).join(' × ') : '–'),
        el('td', { class: 'n opt more' }, known(r.speed) ? digits(r.speed) + ' m/s' : '–'),
        el('td', { class: 'n opt more' }, known(r.near) && known(r.far) ? digits(r.near) + '–' + digits(r.far) : '–'),
        el('td', { class: 'n opt more' }, known(r.saliency) ? r.saliency.toFixed(2) : '–'));
      row.addEventListener('pointerenter', () => light(r.key));
      row.addEventListener('pointerleave', () => light(null));
      body.append(row);
    }
    glow();
  }

  // ---- colour bars ----------------------------------------------------------------
  const tables = {};
  for (const [name, hex] of Object.entries(run.colors)) {
    tables[name] = hex.match(/.{6}/g).map(c => [0, 2, 4].map(k => parseInt(c.slice(k, k + 2), 16)));
  }
  const css = c => `rgb(${c.join(' ')})`;
  const key = (color, text) => el('span', { class: 'key', style: '--c:' + color }, text);
  function bar(scale) {
    const table = tables[scale.colors];
    const steps = Array.from({ length: 17 }, (_, i) => css(table[Math.round(i / 16 * 255)]));
    const node = el('span', { class: 'bar', style: `background:linear-gradient(to ${scale.reversed ? 'left' : 'right'},${steps.join(',')})` });
    scale.ticks.forEach(([at, text]) => node.append(el('i', { style: `left:${at * 100}%` }, text)));
    return node;
  }
  function legend() {
    const node = $('legend'), { key: which } = VIEWS[view];
    node.replaceChildren();
    const scale = run.scales[which];
    if (scale) node.append(bar(scale));
    if (which === 'disparity' || which === 'depth') node.append(key(run.invalid, 'no match'));
    if (which === 'depth') node.append(key(run.beyond, 'beyond range'));
    if (which === 'roi') node.append(key(run.salient, 'salient'), key(run.border, 'matched border'), key('#111', 'left out'));
  }

  // ---- reading a value under the pointer --------------------------------------------
  const ink = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  let inked = '';
  function valueAt(f, x, y) {
    const { key: which } = VIEWS[view];
    const scale = run.scales[which];
    if (!scale) return '';
    const image = $('heroview').children[1];
    if (!image.complete || !image.naturalWidth) return '';
    if (inked !== image.src) {
      ink.canvas.width = image.naturalWidth;
      ink.canvas.height = image.naturalHeight;
      ink.drawImage(image, 0, 0);
      inked = image.src;
    }
    const px = Math.min(image.naturalWidth - 1, Math.floor(x * image.naturalWidth));
    const py = Math.min(image.naturalHeight - 1, Math.floor(y * image.naturalHeight));
    const [r, g, b, a] = ink.getImageData(px, py, 1, 1).data;
    if (a === 0) return 'not matched';
    const is = c => Math.abs(c[0] - r) + Math.abs(c[1] - g) + Math.abs(c[2] - b);
    const rgb = hex => [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16));
    if (which !== 'saliency') {
      if (is(rgb(run.invalid)) < 4) return 'no match';
      if (which === 'depth' && is(rgb(run.beyond)) < 4) return 'beyond range';
      if (which === 'depth' && is(rgb(run.near)) < 4) return 'nearer than the range';
    }
    let best = 0, least = 1e9;
    tables[scale.colors].forEach((c, i) => { const d = is(c); if (d < least) { least = d; best = i; } });
    const t = scale.reversed ? 1 - best / 255 : best / 255;
    const v = scale.log ? scale.low * Math.pow(scale.high / scale.low, t) : scale.low + (scale.high - scale.low) * t;
    return v.toFixed(scale.unit === 'm' ? (v < 10 ? 2 : 1) : scale.unit ? 1 : 2) + (scale.unit ? ' ' + scale.unit : '');
  }
  $('heroview').addEventListener('pointermove', e => {
    const box = $('heroview').getBoundingClientRect();
    const x = (e.clientX - box.left) / box.width, y = (e.clientY - box.top) / box.height;
    if (x < 0 || y < 0 || x >= 1 || y >= 1) return;
    const f = frame(now);
    const value = valueAt(f, x, y);
    $('readout').textContent = `(${Math.floor(x * f.width)}, ${Math.floor(y * f.height)})` + (value ? '  ' + value : '');
    if (VIEWS[view].key === 'regions') {
      const g = e.target.closest ? e.target.closest('g[data-id]') : null;
      light(g ? g.dataset.id : null);
    }
  });
  $('heroview').addEventListener('pointerleave', () => { $('readout').textContent = ''; light(null); });

  // ---- showing ------------------------------------------------------------------------
  const thumbs = VIEWS.map((v, i) => {
    const box = el('span', { class: 'view' }, el('img', { class: 'base', alt: '' }), el('img', { class: 'layer', alt: '' }), svg('svg', { class: 'marks' }));
    const node = el('button', { class: 'thumb', role: 'tab', title: 'key ' + (i + 1) }, box, el('span', {}, el('b', {}, v.name), el('i', {}, ' · ' + v.note)));
    box.style.display = 'block';
    node.addEventListener('click', () => choose(i));
    $('thumbs').append(node);
    return box;
  });

  function show(i) {
    now = Math.max(0, Math.min(sources.length - 1, i));
    const f = frame(now);
    $('desk').classList.toggle('tall', f.width / f.height < 2.4);
    paint($('heroview'), f, view);
    thumbs.forEach((box, k) => paint(box, f, k));
    list(f);
    $('slider').value = now;
    $('slider').style.setProperty('--at', (sources.length > 1 ? now / (sources.length - 1) * 100 : 0) + '%');
    $('where').textContent = `frame ${f.index + 1} of ${run.frames} · ${f.time}`;
    for (const line of document.querySelectorAll('.plot .now')) {
      line.style.left = (run.frames > 1 ? f.index / (run.frames - 1) * 100 : 0) + '%';
    }
    if (now + 1 < sources.length) {
      const next = frame(now + 1);
      for (const source of [next.left, ...Object.values(next.layers)]) new Image().src = source;
    }
  }
  function choose(i) {
    view = i;
    $('heroname').textContent = VIEWS[i].name;
    $('readout').textContent = '';
    document.querySelectorAll('.thumb').forEach((t, k) => t.setAttribute('aria-selected', k === i));
    legend();
    paint($('heroview'), frame(now), view);
  }
  function play(on) {
    clearInterval(timer);
    timer = on ? setInterval(() => show((now + 1) % sources.length), run.pace) : null;
    document.body.classList.toggle('playing', on);
  }
  const step = d => { play(false); show(now + d); };

  $('slider').max = sources.length - 1;
  $('slider').addEventListener('input', e => { play(false); show(+e.target.value); });
  $('back').addEventListener('click', () => step(-1));
  $('forth').addEventListener('click', () => step(1));
  $('play').addEventListener('click', () => play(!timer));
  addEventListener('keydown', e => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const act = {
      ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => step(-1e9), End: () => step(1e9),
      ' ': () => play(!timer),
    }[e.key] || (/^[1-6]$/.test(e.key) ? () => choose(+e.key - 1) : null);
    if (act && !(e.key === ' ' && e.target.tagName === 'BUTTON')) { e.preventDefault(); act(); }
  });
  for (const plot of document.querySelectorAll('.plot.seek')) {
    plot.addEventListener('click', e => {
      const box = plot.getBoundingClientRect();
      const wanted = (e.clientX - box.left) / box.width * (run.frames - 1);
      let best = 0;
      run.shown.forEach((index, i) => { if (Math.abs(index - wanted) < Math.abs(run.shown[best] - wanted)) best = i; });
      step(best - now);
    });
  }
  let width = innerWidth;
  addEventListener('resize', () => { if (innerWidth !== width) { width = innerWidth; show(now); } });

  const asked = /^#frame=(\d+)(?:&view=([1-6]))?$/.exec(location.hash);
  choose(asked && asked[2] ? asked[2] - 1 : view);
  show(asked ? +asked[1] : 0);
})();
