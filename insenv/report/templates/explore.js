'use strict';
// The explorable report: switches, plots that zoom together, state in the address. Texts from files are text nodes only.
(() => {
  const D = JSON.parse(document.getElementById('findings').textContent), root = document.documentElement;
  const css = name => getComputedStyle(root).getPropertyValue(name).trim();
  const num = v => !isFinite(v) ? '–' : v === 0 ? '0' : Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? v.toExponential(2) : String(+v.toPrecision(3));
  const narrow = () => innerWidth < 640;

  function el(tag, attributes, ...children) {
    const e = document.createElement(tag);
    for (const [k, v] of Object.entries(attributes || {})) {
      if (k.startsWith('on')) e.addEventListener(k.slice(2), v);
      else if (v === true) e.setAttribute(k, '');
      else if (v !== false && v != null) e.setAttribute(k, v);
    }
    e.append(...children.filter(c => c != null));
    return e;
  }

  function means(values, range) { // a symmetric limit that shows the bulk
    const size = [];
    values.forEach(series => series.forEach((v, i) => { if (v != null && isFinite(v) && (!range || range(i))) size.push(Math.abs(v)); }));
    size.sort((a, b) => a - b);
    if (!size.length || !size[size.length - 1]) return 1;
    const bulk = size[Math.floor(0.995 * (size.length - 1))], top = size[size.length - 1];
    return top <= 2.5 * bulk ? 1.1 * top : 1.5 * bulk;
  }

  function longest(T, t) { // stretch of consecutive bins
    let best = [0, 0], a = 0;
    for (let i = 1; i <= T.n; i++) if (i === T.n || t[i] - t[i - 1] > 1.5 * T.width || t[i] < t[i - 1]) { if (i - a > best[1] - best[0]) best = [a, i]; a = i; }
    return best[1] - best[0] < 8 ? [0, T.n] : best;
  }

  function allan(x, width, counts) {
    const sum = new Float64Array(x.length + 1);
    for (let i = 0; i < x.length; i++) sum[i + 1] = sum[i] + x[i];
    return counts.map(m => {
      let s = 0, n = 0;
      for (let i = 0; i + 2 * m <= x.length; i++) { const d = (sum[i + 2 * m] - 2 * sum[i + m] + sum[i]) / m; s += d * d; n++; }
      return n ? Math.sqrt(s / (2 * n)) : null;
    });
  }

  function welch(x, width) { // two-sided root density, Hann windows that overlap by half; averaged to 24 a decade
    let size = 16;
    while (size * 8 <= x.length) size *= 2;
    if (x.length < size) return [[], []];
    const power = new Float64Array(size / 2), window = Float64Array.from({length: size}, (_, i) => Math.sin(Math.PI * (i + 0.5) / size) ** 2);
    const norm = window.reduce((s, v) => s + v * v, 0);
    let count = 0;
    for (let a = 0; a + size <= x.length; a += size / 2) {
      const re = x.slice(a, a + size), im = new Float64Array(size), mean = re.reduce((s, v) => s + v, 0) / size;
      for (let i = 0; i < size; i++) re[i] = (re[i] - mean) * window[i];
      GLS.fft(re, im);
      for (let k = 0; k < size / 2; k++) power[k] += (re[k] ** 2 + im[k] ** 2) * width / norm;
      count++;
    }
    const f = [], root = [];
    let bin = null;
    for (let k = 1; k < size / 2; k++) {
      const at = Math.floor(24 * Math.log10(k));
      if (bin && bin.at === at) { bin.n++; bin.f += Math.log(k); bin.s += power[k]; } else { bin = {at, n: 1, f: Math.log(k), s: power[k]}; f.push(bin); }
    }
    for (const b of f) root.push(Math.sqrt(b.s / b.n / count));
    return [f.map(b => Math.exp(b.f / b.n) / (size * width)), root];
  }

  function axis(label) {
    const ink = () => css('--ink'), grid = () => css('--grid');
    return {label, stroke: ink, labelSize: 22, size: 54, font: '12px system-ui, sans-serif', labelFont: '12px system-ui, sans-serif', grid: {stroke: grid, width: 1}, ticks: {stroke: grid, width: 1}};
  }
  const flat = label => ({...axis(label), size: 40, space: 56});
  const dots = (label, colour, size) => ({label, stroke: () => css(colour), paths: () => null, points: {show: true, size, width: 0, fill: () => css(colour)}});
  const curve = (label, colour, more) => ({label, stroke: () => css(colour), width: 2, points: {show: false}, ...more});
  const decades = (u, values) => values.map(v => { const p = Math.log10(v); return Math.abs(p - Math.round(p)) < 1e-6 ? (v >= 1e-3 && v < 1e5 ? String(+v.toPrecision(6)) : '1e' + Math.round(p)) : ''; });

  class Target {
    constructor(T) {
      this.T = T;
      this.place = document.getElementById(T.id + '-explore');
      this.found = T.switches.map(s => s.role === 'declared' || s.role === 'added');
      this.on = this.last = [...this.found];
      this.declared = T.switches.map(s => s.role === 'declared');
      this.zoom = {name: 'time', range: null};
      this.both = true;
      this.series = !T.models && !T.whole;
    }

    async open() {
      if (this.ready) return;
      const problem = await problemOf(this.T, D.unit);
      this.a = problem.arrays;
      this.ready = problem.solve ? problem : GLS.prepare(problem);
      this.solve = problem.solve || (on => GLS.solve(this.ready, on));
      const held = new Uint8Array(this.T.n);
      for (const b of this.T.blocks) if (!b.fitted) held.fill(1, b.start, b.start + b.n);
      this.held = held;
      this.stretch = longest(this.T, this.a.t);
      const n = this.stretch[1] - this.stretch[0];
      this.counts = [1, 2, 3];
      for (let m = 4; m <= n / 4; m *= 1.5) this.counts.push(Math.round(m));
      this.base = this.solve(this.declared);
      this.asFound = this.solve(this.found);
      this.build();
      this.update();
      this.alternatives();
    }

    build() {
      const T = this.T, unit = T.unit, id = T.id;
      const group = (role, legend) => {
        const rows = T.switches.map((s, i) => [s, i]).filter(([s]) => s.role === role);
        return rows.length ? el('fieldset', {}, el('legend', {}, legend), ...rows.map(([s, i]) => {
          const box = el('input', {type: 'checkbox', 'data-switch': i, onchange: e => { this.on[i] = e.target.checked; this.update(); }});
          const note = [s.of && 'instead of ' + s.of, s.shape, s.note].filter(Boolean).join('; ');
          return el('label', {}, box, el('span', {}, s.name + ' ', el('code', {}, s.key), note ? el('small', {}, note) : null));
        })) : null;
      };
      const button = (text, press) => el('button', {type: 'button', onclick: press}, text);
      const set = on => { this.on = [...on]; this.update(); };
      this.set = set;
      this.kpi = el('div', {class: 'kpi', role: 'status', 'aria-live': 'polite'});
      this.readout = el('p', {class: 'note readout', 'aria-live': 'polite'});
      const number = (label, k) => el('label', {class: 'field'}, label, el('input', {type: 'number', step: 'any', 'data-edge': k, onchange: () => this.edges()}));
      this.fields = el('div', {class: 'range', role: 'group', 'aria-label': 'shown range'}, number('from', 0), number('to', 1), el('span', {class: 'soft'}, ''),
        button('Show all', () => { this.zoom = {name: 'time', range: null}; this.draw(); }),
        button('Copy as CSV', () => this.copy(this.csv())), button('Copy as [held_out]', () => this.copy(this.heldOut())));
      this.copied = el('textarea', {readonly: true, hidden: true, rows: 5, 'aria-label': 'copied text'});
      const keep = el('label', {class: 'inline'}, el('input', {type: 'checkbox', checked: true, onchange: e => { this.both = e.target.checked; this.draw(); }}), 'show the declared model too');
      this.hosts = {time: el('div', {class: 'plot'})};
      const panel = (key, title, good) => el('figure', {}, el('h4', {}, title), this.hosts[key] = el('div', {class: 'plot'}), el('figcaption', {}, good));
      const panels = T.against.map(c => panel(c.name, 'Residual against ' + c.label, 'Good: level. It shows what the range in time holds; drag here, and time shows these bins alone.'));
      if (this.series) panels.push(panel('allan', 'Allan deviation', 'Good: the measured curve follows the fitted noise.'), panel('spectrum', 'Spectrum', 'Good: no peak stands out of the fitted noise.'));
      this.table = el('div', {class: 'scroll'});
      this.others = el('div', {});
      const cleaned = T.cleaned.length ? ' Taken out of the samples beforehand, in every model here: ' + T.cleaned.join(', ') + '.' : '';
      this.place.append(
        el('p', {class: 'note'}, T.whole ? 'Each switch fits the model of the whole unit anew, its six channels and the errors of the table together, as insenv does; it holds on every tab.' :
          T.models ? 'Each switch shows the model that insenv fitted without it or with it, on the same rests and turns.' :
          'Each switch fits the model anew on the fitted data, noise and all, as insenv does; shapes such as time constants and frequencies stay as found, and deviations are those for known shapes.' + cleaned),
        el('div', {class: 'board'},
          el('div', {class: 'model', role: 'group', 'aria-label': 'effects of the model'}, group('declared', 'Declared'), group('added', 'Added'), group('rival', 'Cannot be told apart'), group('refused', 'Tried and refused'),
            el('p', {}, button('As found', () => set(this.found)), ' ', button('Declared only', () => set(this.declared)))),
          el('div', {class: 'result'}, this.kpi,
            el('figure', {}, el('h4', {}, 'Residual against time'), this.hosts.time,
              el('figcaption', {}, 'Shaded: held out, no fit saw it. Drag to zoom; with the keyboard: arrows go from bin to bin, + and − zoom, 0 shows all. Good: a level band that is no wider in the shaded part.')),
            this.readout, keep, this.fields, this.copied)),
        el('div', {class: 'grid'}, ...panels), el('h4', {}, 'Coefficients'), this.table, this.others);
      this.place.hidden = false;
      this.plot(unit);
    }

    plot(unit) {
      const T = this.T, x = this.a.x, width = key => Math.max(260, this.hosts[key].clientWidth), size = Math.max(2.5, Math.min(6, 120 / Math.sqrt(T.n) * 2));
      const shade = u => {
        if (this.axisOf(u) !== 'time') return;
        u.ctx.save();
        u.ctx.fillStyle = css('--held');
        let apart = Infinity; // a block of one bin is as wide as bins are apart where they follow each other
        for (let i = 1; i < T.n; i++) if (x[i] > x[i - 1]) apart = Math.min(apart, x[i] - x[i - 1]);
        for (const b of T.blocks) if (!b.fitted) {
          const i = Math.min(b.start, T.n - 2), half = b.n > 1 || !this.series ? 0.5 * (x[i + 1] - x[i]) : 0.5 * apart, l = Math.max(u.valToPos(x[b.start] - half, 'x', true), u.bbox.left);
          const r = Math.min(u.valToPos(x[b.start + b.n - 1] + half, 'x', true), u.bbox.left + u.bbox.width);
          if (r > l) u.ctx.fillRect(l, u.bbox.top, r - l, u.bbox.height);
        }
        u.ctx.restore();
      };
      const select = u => {
        if (u.select.width < 4) return;
        const range = [u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x')];
        u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
        this.zoom = {name: this.axisOf(u), range};
        this.draw();
      };
      const legend = {live: false}, drag = {x: true, y: false, setScale: false};
      const scatter = (key, label, height) => new uPlot({
        width: width(key), height, legend, cursor: {drag, points: {show: key === 'time'}}, scales: {x: {time: false}},
        axes: [flat(label), axis('residual [' + unit + ']')], hooks: {drawClear: [shade], setSelect: [select], setCursor: key === 'time' ? [u => this.read(u.cursor.idx)] : []},
        series: [{label}, dots('declared model', '--before', size), dots('this model', '--after', size)],
      }, [[], [], []], this.hosts[key]);
      const loglog = (key, label, y) => new uPlot({
        width: width(key), height: 280, legend, cursor: {drag: {x: false, y: false}}, scales: {x: {time: false, distr: 3}, y: {distr: 3}},
        axes: [{...flat(label), values: decades}, {...axis(y), values: decades}],
        series: [{label}, curve('declared model', '--before'), curve('this model', '--after'), curve('fitted noise', '--ink', {dash: [6, 4], width: 1.5})],
      }, [[], [], [], []], this.hosts[key]);
      this.plots = {time: scatter('time', T.timeLabel, narrow() ? 240 : 300)};
      this.order = {time: [...x.keys()]};
      for (const c of T.against) {
        this.order[c.name] = [...x.keys()].sort((i, j) => this.a[c.name][i] - this.a[c.name][j]);
        this.plots[c.name] = scatter(c.name, c.label, 260);
      }
      if (this.series) this.plots.allan = loglog('allan', 'averaging time [s]', 'Allan deviation [' + unit + ']');
      if (this.series) this.plots.spectrum = loglog('spectrum', 'frequency [Hz]', 'root PSD [' + unit + '/√Hz]');
      for (const [key, host] of Object.entries(this.hosts)) { host.setAttribute('role', 'img'); host.setAttribute('aria-label', 'plot: ' + key + '; its figures are in the tables'); }
      this.hosts.time.tabIndex = 0;
      this.hosts.time.addEventListener('keydown', e => this.key(e));
    }

    axisOf(u) { return Object.keys(this.plots || {}).find(k => this.plots[k] === u) || 'time'; }
    values(name) { return name === 'time' ? this.a.x : this.a[name]; }
    inside(i) { const {name, range} = this.zoom, v = this.values(name)[i]; return !range || v >= range[0] && v <= range[1]; }

    update() {
      const fit = this.solve(this.on);
      if (!fit) {
        this.on = [...this.last];
        this.readout.textContent = 'Too few rests and turns tell that model: the last one stays.';
      } else {
        this.now = fit;
        this.last = [...this.on];
      }
      this.place.querySelectorAll('[data-switch]').forEach(e => { e.checked = this.on[+e.dataset.switch]; });
      const T = this.T, F = T.factor, cell = (label, v) => el('div', {}, el('span', {class: 'soft'}, label), el('b', {}, v));
      const before = this.base.rms / F, now = this.now.rms / F;
      this.kpi.replaceChildren(cell('held-out error, declared model', num(before) + ' ' + T.unit), cell('this model', num(now) + ' ' + T.unit),
        cell('change', before ? Math.round(100 * (now / before - 1)) + ' %' : '–'), cell('its noise alone', num(this.now.floor / F) + ' ' + T.unit));
      this.place.dataset.rms = this.now.rms;
      const row = t => { const c = T.columns[t.column], was = this.asFound.theta.find(o => o.column === t.column), s = T.switches[c.s];
        return el('tr', {}, el('td', {}, s.name + ' ', el('code', {}, c.name)), el('td', {class: 'n'}, num(t.value / c.per) + ' ± ' + num(t.sd / c.per)), el('td', {class: 'n'}, was ? num(was.value / c.per) : '—'), el('td', {}, c.unit)); };
      this.table.replaceChildren(el('table', {}, el('tr', {}, ...['effect', 'this model', 'as found', 'unit'].map((h, k) => el('th', {scope: 'col', class: k === 1 || k === 2 ? 'n' : ''}, h))), ...this.now.theta.map(row)));
      this.draw();
    }

    draw() {
      const T = this.T, F = T.factor, base = this.base.left.map(v => v / F), now = this.now.left.map(v => v / F);
      for (const key of ['time', ...T.against.map(c => c.name)]) {
        const order = this.order[key], v = this.values(key), u = this.plots[key], shown = i => key === this.zoom.name || this.inside(i);
        const pick = series => order.map(i => shown(i) ? series[i] : null), limit = means(this.both ? [base, now] : [now], i => this.inside(i));
        const range = key === this.zoom.name && this.zoom.range || [v[order[0]], v[order[order.length - 1]]], pad = key === this.zoom.name && this.zoom.range ? 0 : 0.01 * (range[1] - range[0]);
        u.batch(() => {
          u.setData([order.map(i => v[i]), this.both ? pick(base) : order.map(() => null), pick(now)], false);
          u.setScale('x', {min: range[0] - pad, max: range[1] + pad});
          u.setScale('y', {min: -limit, max: limit});
        });
      }
      if (this.series) this.noise(base, now);
      const edges = this.fields.querySelectorAll('input'), whole = this.values(this.zoom.name), range = this.zoom.range || [Math.min(...whole), Math.max(...whole)];
      edges.forEach((e, k) => { e.value = +range[k].toPrecision(6); });
      this.fields.querySelector('span').textContent = this.zoom.name === 'time' ? T.timeLabel : T.against.find(c => c.name === this.zoom.name).label;
      address();
    }

    noise(base, now) {
      const T = this.T, F = T.factor;
      const [a, b] = this.stretch, tau = this.counts.map(m => m * T.width), lines = [base, now].map(s => s.slice(a, b)), power = this.now.power;
      this.plots.allan.setData([tau, ...lines.map(s => allan(s, T.width, this.counts)), GLS.allan(this.ready.problem, power, this.counts).map(v => v / F)]);
      const [f, first] = welch(lines[0], T.width), second = welch(lines[1], T.width)[1];
      this.plots.spectrum.setData([f, first, second, GLS.density(this.ready.problem, power, f).map(v => Math.sqrt(v) / F)]);
    }

    edges() {
      const range = [...this.fields.querySelectorAll('input')].map(e => +e.value);
      if (range[1] > range[0]) { this.zoom = {name: this.zoom.name, range}; this.draw(); }
    }

    read(i) {
      if (i == null || !this.now) return;
      const F = this.T.factor;
      this.readout.textContent = `${this.T.timeLabel} ${num(this.a.x[i])}: declared model ${num(this.base.left[i] / F)}, this model ${num(this.now.left[i] / F)} ${this.T.unit}${this.held[i] ? ', held out' : ''}`;
    }

    key(e) {
      const u = this.plots.time, x = this.a.x, n = this.T.n, step = e.shiftKey ? 20 : 1, range = this.zoom.name === 'time' && this.zoom.range || [x[0], x[n - 1]];
      let i = this.at == null ? Math.max(0, x.findIndex(v => v >= range[0])) : this.at;
      if (e.key === 'ArrowRight') i += step; else if (e.key === 'ArrowLeft') i -= step; else if (e.key === 'Home') i = 0; else if (e.key === 'End') i = n - 1;
      else if ('+-=0'.includes(e.key)) {
        const half = (range[1] - range[0]) / (e.key === '-' ? 1 : 4);
        this.zoom = {name: 'time', range: e.key === '0' ? null : [Math.max(x[0], x[i] - half), Math.min(x[n - 1], x[i] + half)]};
        this.draw();
      } else return;
      e.preventDefault();
      this.at = i = Math.min(n - 1, Math.max(0, i));
      u.setCursor({left: u.valToPos(x[i], 'x'), top: u.valToPos(this.now.left[i] / this.T.factor, 'y')});
      this.read(i);
    }

    chosen() { return [...Array(this.T.n).keys()].filter(i => this.inside(i)); }

    csv() {
      const T = this.T, names = T.against.map(c => c.label), F = T.factor;
      const head = ['run', 'time [s]', `declared model [${T.unit}]`, `this model [${T.unit}]`, ...names, 'held out'], run = new Array(T.n);
      for (const b of T.blocks) run.fill(b.run, b.start, b.start + b.n);
      const rows = this.chosen().map(i => [run[i], this.a.t[i], this.base.left[i] / F, this.now.left[i] / F, ...T.against.map(c => this.a[c.name][i]), this.held[i]].map(v => +(+v).toPrecision(7)).join(','));
      return [head.map(h => h.replace(/,/g, ' ')).join(','), ...rows].join('\n') + '\n';
    }

    heldOut() { // rows of a manifest, half-open; bins that follow each other are one range
      if (this.T.whole) return '[held_out]\npositions = [' + [...new Set(this.chosen().map(i => this.a.first[i]))].join(', ') + ']\n';
      const ranges = [];
      for (const i of this.chosen()) {
        const first = this.a.first[i], end = this.a.end[i], last = ranges[ranges.length - 1];
        if (last && first <= last[1] + 1) last[1] = end; else ranges.push([first, end]);
      }
      return '[held_out]\nrows = [' + ranges.map(r => `[${r[0]}, ${r[1]}]`).join(', ') + ']\n';
    }

    async copy(text) {
      this.copied.value = text;
      this.copied.hidden = false;
      try { await navigator.clipboard.writeText(text); this.readout.textContent = 'Copied; it also stands below.'; } catch (e) {
        this.copied.focus();
        this.copied.select();
        this.readout.textContent = 'Select and copy what stands below.';
      }
    }

    alternatives() { // of each effect that has rivals: the models side by side
      const T = this.T;
      T.switches.forEach((s, k) => {
        const rivals = T.switches.map((r, j) => [r, j]).filter(([r]) => r.role === 'rival' && r.of === s.key);
        if (s.role !== 'added' || !rivals.length) return;
        const models = [[s, k], ...rivals].map(([r, j]) => ({r, on: this.found.map((v, i) => i === j || v && i !== k)}));
        models.forEach(m => { m.fit = this.solve(m.on); });
        if (!models.every(m => m.fit)) return;
        const best = Math.max(...models.map(m => m.fit.loglik));
        const value = m => m.fit.theta.filter(t => T.switches[T.columns[t.column].s] === m.r).map(t => { const c = T.columns[t.column]; return `${c.name} = ${num(t.value / c.per)} ± ${num(t.sd / c.per)} ${c.unit}`; }).join(', ');
        const rows = [['held-out error [' + T.unit + ']', m => num(m.fit.rms / T.factor)], ['log-likelihood below the best', m => (best - m.fit.loglik).toFixed(1)], ['coefficients', value], ['shape', m => m.r.shape || '—'],
          ['', m => el('button', {type: 'button', onclick: () => this.set(m.on)}, 'Show')]];
        this.others.append(el('h4', {}, 'Side by side: this recording cannot tell these apart'), el('div', {class: 'scroll'}, el('table', {}, el('tr', {}, el('th', {scope: 'col'}, ''), ...models.map(m => el('th', {scope: 'col'}, m.r.name))),
          ...rows.map(([label, cell]) => el('tr', {}, el('th', {scope: 'row'}, label), ...models.map(m => el('td', {}, cell(m))))))));
      });
    }

    resize() { for (const [key, u] of Object.entries(this.plots || {})) u.setSize({width: Math.max(260, this.hosts[key].clientWidth), height: u.height}); }
  }

  const targets = D.targets.map(T => new Target(T)), sections = [...document.querySelectorAll('section[data-target]')];
  let current = 0;

  function address() {
    const t = targets.find(t => t.T.id === sections[current].id);
    const said = new URLSearchParams({target: sections[current].id});
    if (t && t.ready) {
      said.set('on', t.on.map((v, i) => v ? i : -1).filter(i => i >= 0).join('.'));
      if (t.zoom.range) { said.set('x', t.zoom.name); said.set('range', t.zoom.range.map(v => +v.toPrecision(6)).join('_')); }
    }
    try { history.replaceState(null, '', '#' + said); } catch (e) { /* an address that cannot be written is none */ }
  }

  const tabs = el('div', {class: 'tabs', role: 'tablist', 'aria-label': 'targets'});
  async function show(k, focus) {
    const from = targets.find(t => t.T.id === sections[current].id && t.T.whole && t.ready) || {};
    current = k;
    sections.forEach((s, i) => { s.hidden = i !== k; });
    [...tabs.children].forEach((b, i) => { b.setAttribute('aria-selected', i === k); b.tabIndex = i === k ? 0 : -1; });
    if (focus) tabs.children[k].focus();
    const t = targets.find(t => t.T.id === sections[k].id);
    if (t) {
      if (t.T.whole && from.on) { t.on = [...from.on]; if (t.ready) t.update(); }
      await t.open();
      t.resize();
    }
    address();
  }
  const said = new URLSearchParams(location.hash.slice(1));
  if (sections.length > 1) {
    sections.forEach((s, i) => {
      s.setAttribute('role', 'tabpanel');
      tabs.append(el('button', {type: 'button', role: 'tab', 'aria-controls': s.id, onclick: () => show(i)}, s.dataset.target));
    });
    tabs.addEventListener('keydown', e => {
      const to = {ArrowRight: current + 1, ArrowLeft: current - 1, Home: 0, End: sections.length - 1}[e.key];
      if (to != null) { e.preventDefault(); show((to + sections.length) % sections.length, true); }
    });
    sections[0].before(tabs);
    document.querySelectorAll('a[href^="#t"]').forEach(a => a.addEventListener('click', e => { const k = sections.findIndex(s => '#' + s.id === a.getAttribute('href')); if (k >= 0) { e.preventDefault(); show(k, true); } }));
  }
  const wanted = sections.findIndex(s => s.id === said.get('target') || '#' + s.id === location.hash), t = targets.find(t => t.T.id === said.get('target'));
  if (t && said.has('on')) { const on = said.get('on').split('.').filter(Boolean).map(Number); t.on = t.on.map((_, i) => on.includes(i)); }
  if (t && said.has('range')) {
    const range = said.get('range').split('_').map(Number), name = said.get('x');
    if (range.length === 2 && range[1] > range[0] && (name === 'time' || t.T.against.some(c => c.name === name))) t.zoom = {name, range};
  }
  show(Math.max(0, wanted)).then(() => { root.classList.add('live'); root.dataset.ready = 'yes'; targets.forEach(t => t.resize()); })
    .catch(e => { root.dataset.ready = 'no'; sections.forEach(s => { s.hidden = false; }); tabs.remove(); console.error(e); });
  let wait;
  addEventListener('resize', () => { clearTimeout(wait); wait = setTimeout(() => targets.forEach(t => t.resize()), 100); });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => targets.forEach(t => Object.values(t.plots || {}).forEach(u => u.redraw())));
})();
