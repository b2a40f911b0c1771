'use strict';
// Generalised least squares in the modes of the DCT-II, noise by restricted maximum likelihood: as insenv.identify.fit.
const GLS = (() => {
  const ABSENT = 1e-9, NONE = 1e-90, ROUNDING = 1e-15, RIDGE = 1e-11, FLAT = 0.02, COLLINEAR = 1e-5, GROUPS = 100;

  // Arrays of whole numbers times a step: differences of some order, zigzag, planes of bytes.
  async function unpack(text, parts) {
    const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer()), found = {};
    let at = 0;
    for (const [name, n, step, order] of parts) {
      const values = new Float64Array(n);
      for (let i = 0; i < n; i++) {
        const u = bytes[at + i] | bytes[at + n + i] << 8 | bytes[at + 2 * n + i] << 16 | bytes[at + 3 * n + i] << 24;
        values[i] = (u >>> 1) ^ -(u & 1);
      }
      for (let k = 0; k < order; k++) for (let i = 1; i < n; i++) values[i] += values[i - 1];
      for (let i = 0; i < n; i++) values[i] *= step;
      at += 4 * n;
      found[name] = values;
    }
    return found;
  }

  function fft(re, im) { // in place, a power of two
    const n = re.length;
    for (let i = 1, j = 0; i < n; i++) {
      let bit = n >> 1;
      for (; j & bit; bit >>= 1) j ^= bit;
      j ^= bit;
      if (i < j) { let t = re[i]; re[i] = re[j]; re[j] = t; t = im[i]; im[i] = im[j]; im[j] = t; }
    }
    for (let size = 2; size <= n; size *= 2) {
      const half = size / 2, step = -2 * Math.PI / size;
      const c = new Float64Array(half), s = new Float64Array(half);
      for (let k = 0; k < half; k++) { c[k] = Math.cos(step * k); s[k] = Math.sin(step * k); }
      for (let i = 0; i < n; i += size) for (let k = 0; k < half; k++) {
        const a = i + k, b = a + half, x = re[b] * c[k] - im[b] * s[k], y = re[b] * s[k] + im[b] * c[k];
        re[b] = re[a] - x; im[b] = im[a] - y; re[a] += x; im[a] += y;
      }
    }
  }

  const chirps = new Map();
  function chirp(n) { // Bluestein: a transform of any length by three of a power of two
    if (!chirps.has(n)) {
      let m = 1;
      while (m < 2 * n) m *= 2;
      const c = new Float64Array(n), s = new Float64Array(n), re = new Float64Array(m), im = new Float64Array(m);
      for (let k = 0; k < n; k++) {
        const w = Math.PI * ((k * k) % (2 * n)) / n;
        c[k] = Math.cos(w); s[k] = Math.sin(w);
        re[k] = c[k]; im[k] = s[k];
        if (k) { re[m - k] = c[k]; im[m - k] = s[k]; }
      }
      fft(re, im);
      chirps.set(n, {m, c, s, re, im});
    }
    return chirps.get(n);
  }

  function dft(x, y) { // complex, any length
    const n = x.length, {m, c, s, re, im} = chirp(n), a = new Float64Array(m), b = new Float64Array(m);
    for (let k = 0; k < n; k++) { a[k] = x[k] * c[k] + y[k] * s[k]; b[k] = y[k] * c[k] - x[k] * s[k]; }
    fft(a, b);
    for (let k = 0; k < m; k++) { // times the chirp's; conjugated, so that the way back is a way there
      const p = a[k] * re[k] - b[k] * im[k], q = a[k] * im[k] + b[k] * re[k];
      a[k] = p; b[k] = -q;
    }
    fft(a, b);
    const u = new Float64Array(n), v = new Float64Array(n);
    for (let k = 0; k < n; k++) {
      const p = a[k] / m, q = -b[k] / m;
      u[k] = p * c[k] + q * s[k]; v[k] = q * c[k] - p * s[k];
    }
    return [u, v];
  }

  function dct(x, into, at) { // orthonormal DCT-II of one block
    const n = x.length, v = new Float64Array(n);
    for (let i = 0; 2 * i < n; i++) v[i] = x[2 * i];
    for (let i = 0; 2 * i + 1 < n; i++) v[n - 1 - i] = x[2 * i + 1];
    const [re, im] = dft(v, new Float64Array(n));
    for (let k = 0; k < n; k++) {
      const w = Math.PI * k / (2 * n);
      into[at + k] = (re[k] * Math.cos(w) + im[k] * Math.sin(w)) * Math.sqrt((k ? 2 : 1) / n);
    }
  }

  function transform(blocks, x) {
    const out = new Float64Array(blocks.reduce((n, b) => n + b.n, 0));
    let at = 0;
    for (const b of blocks) { dct(x.subarray(b.start, b.start + b.n), out, at); at += b.n; }
    return out;
  }

  function spectra(problem, lam) { // of the noise terms at an eigenvalue, from the table
    const {lam: x, spectra: y, terms} = problem, n = x.length;
    const at = Math.min(n - 1, Math.max(0, (n - 1) * Math.log(lam / x[0]) / Math.log(x[n - 1] / x[0])));
    const i = Math.min(n - 3, Math.max(1, Math.floor(at))), d = at - i; // a cubic through the four next to it
    const w = [-d * (d - 1) * (d - 2) / 6, (d + 1) * (d - 1) * (d - 2) / 2, -(d + 1) * d * (d - 2) / 2, (d + 1) * d * (d - 1) / 6];
    return terms.map((_, j) => Math.exp(w.reduce((s, v, k) => s + v * y[j * n + i - 1 + k], 0)));
  }

  function modes(problem, blocks) { // their variances, and which are no level
    const lam = [], shapes = [], scatter = [];
    for (const b of blocks) for (let k = 0; k < b.n; k++) {
      const half = m => 4 * Math.sin(0.25 * Math.PI / m) ** 2, own = k ? 4 * Math.sin(0.5 * Math.PI * k / b.n) ** 2 : half(b.n);
      let s = spectra(problem, own);
      if (!k) { const run = spectra(problem, half(b.span)); s = s.map((v, j) => Math.max(v, run[j] * b.n / b.span)); }
      lam.push(own); shapes.push(s); scatter.push(k > 0 || b.n === 1); // a block of one has nothing but its level
    }
    return {lam, shapes, scatter};
  }

  function grouping({lam, shapes}) {
    const order = lam.map((_, i) => i).sort((a, b) => lam[a] - lam[b] || shapes[a][0] - shapes[b][0] || a - b);
    const low = 0.999 * lam[order[0]], high = 1.001 * lam[order[order.length - 1]], groups = [];
    const label = v => Math.ceil(GROUPS * Math.log(v / low) / Math.log(high / low));
    order.forEach((i, k) => {
      const before = order[k - 1];
      const jump = k && shapes[i].some((v, j) => Math.abs(Math.log(v + 1e-300) - Math.log(shapes[before][j] + 1e-300)) > 0.2);
      if (!k || jump || label(lam[i]) > label(lam[before])) groups.push([]);
      groups[groups.length - 1].push(i);
    });
    return groups;
  }

  // What does not depend on which effects are on: transformed columns, cross-products of groups of modes.
  function prepare(problem) {
    const fitted = problem.blocks.filter(b => b.fitted), held = problem.blocks.filter(b => !b.fitted);
    const mode = modes(problem, fitted), groups = grouping(mode), n = mode.lam.length;
    const free = problem.free.map(i => { const x = new Float64Array(problem.n); x[i] = 1; return {x, prior: Infinity, s: -1, step: 0}; });
    const columns = [...free, ...problem.columns];
    const weight = mode.shapes.map(s => 1 / Math.sqrt(s[0] + s[2] * problem.width ** 2));
    for (const c of columns) {
      c.t = transform(fitted, c.x);
      c.rounding = c.step ** 2 / 12 * weight.reduce((s, w) => s + w * w, 0); // what it leaves in the whitened column
      c.scale = Math.sqrt(c.t.reduce((s, v) => s + v * v, 0) / n);
      if (c.scale > 0) { c.t = c.t.map(v => v / c.scale); c.p = 1 / (c.prior * c.scale) ** 2; c.rounding /= c.scale ** 2; }
    }
    const all = [transform(fitted, problem.y), ...columns.map(c => c.t)], c = all.length;
    const cross = new Float64Array(groups.length * c * c), gram = new Float64Array(c * c);
    groups.forEach((rows, g) => {
      for (let a = 0; a < c; a++) for (let b = 0; b <= a; b++) {
        let sum = 0;
        const x = all[a], y = all[b];
        for (const i of rows) sum += x[i] * y[i];
        cross[(g * c + a) * c + b] = cross[(g * c + b) * c + a] = sum;
      }
    });
    for (let a = 0; a < c; a++) for (let b = 0; b <= a; b++) {
      let sum = 0;
      const x = all[a], y = all[b];
      for (let i = 0; i < n; i++) sum += x[i] * y[i] * weight[i] * weight[i];
      gram[a * c + b] = gram[b * c + a] = sum;
    }
    const shapes = groups.map(rows => problem.terms.map((_, j) => rows.reduce((s, i) => s + mode.shapes[i][j], 0) / rows.length));
    return {problem, fitted, mode, held: modes(problem, held), columns, all, cross, gram, c, shapes, count: groups.map(g => g.length)};
  }

  function independent(ready, wanted) { // columns that add something new on the fitted bins, in their order
    const {gram, c} = ready, kept = [], L = [];

    for (const j of wanted) {
      const own = gram[(j + 1) * c + j + 1];
      if (!(own > 0)) continue;
      const row = [];
      let rest = own;
      kept.forEach((i, r) => {
        let s = gram[(j + 1) * c + i + 1];
        for (let k = 0; k < r; k++) s -= row[k] * L[r][k];
        row.push(s / L[r][r]);
        rest -= row[r] * row[r];
      });
      // What the rounding of the columns leaves of one that the others span.
      const of = [];
      let rounding = ready.columns[j].rounding;
      for (let r = kept.length - 1; r >= 0; r--) {
        of[r] = row[r];
        for (let k = r + 1; k < kept.length; k++) of[r] -= L[k][r] * of[k];
        of[r] /= L[r][r];
        rounding += of[r] ** 2 * ready.columns[kept[r]].rounding;
      }
      if (ready.columns[j].s >= 0 && rest < own * COLLINEAR ** 2 + 30 * rounding) continue;
      row.push(Math.sqrt(Math.max(rest, 1e-300)));
      L.push(row); kept.push(j);
    }
    return kept;
  }

  function cholesky(a, k) { // lower factor of a symmetric matrix, and its inverse
    const L = new Float64Array(k * k), inverse = new Float64Array(k * k), M = new Float64Array(k * k);
    for (let i = 0; i < k; i++) for (let j = 0; j <= i; j++) {
      let s = a[i * k + j];
      for (let m = 0; m < j; m++) s -= L[i * k + m] * L[j * k + m];
      L[i * k + j] = i === j ? Math.sqrt(Math.max(s, 1e-300)) : s / L[j * k + j];
    }
    for (let j = 0; j < k; j++) for (let i = j; i < k; i++) {
      let s = i === j ? 1 : 0;
      for (let m = j; m < i; m++) s -= L[i * k + m] * M[m * k + j];
      M[i * k + j] = s / L[i * k + i];
    }
    for (let i = 0; i < k; i++) for (let j = 0; j <= i; j++) {
      let s = 0;
      for (let m = i; m < k; m++) s += M[m * k + i] * M[m * k + j];
      inverse[i * k + j] = inverse[j * k + i] = s;
    }
    return {L, inverse};
  }

  function pooled(ready, kept) {
    const {cross, c, count, shapes} = ready, index = [0, ...kept.map(j => j + 1)], k = index.length;
    const small = new Float64Array(count.length * k * k), prior = kept.map(j => ready.columns[j].p || 0);
    for (let g = 0; g < count.length; g++) for (let a = 0; a < k; a++) for (let b = 0; b < k; b++)
      small[(g * k + a) * k + b] = cross[(g * c + index[a]) * c + index[b]];
    return {cross: small, k, prior, count, shapes};
  }

  function weighted(pool, weight) {
    const {cross, k} = pool, sum = new Float64Array(k * k);
    for (let g = 0; g < weight.length; g++) for (let i = 0, at = g * k * k; i < k * k; i++) sum[i] += weight[g] * cross[at + i];
    return sum;
  }

  function normal(pool, s, ridge) { // coefficients, energy and lost freedom of each group for its variances
    const {k, cross, count, prior} = pool, p = k - 1, a = weighted(pool, s.map(v => 1 / v)), axx = new Float64Array(p * p);
    for (let i = 0; i < p; i++) for (let j = 0; j < p; j++) axx[i * p + j] = a[(i + 1) * k + j + 1];
    for (let i = 0; i < p; i++) axx[i * p + i] = (axx[i * p + i] + prior[i]) * (1 + ridge);
    const {L, inverse} = cholesky(axx, p), r = new Float64Array(k);
    r[0] = 1;
    for (let i = 0; i < p; i++) for (let j = 0; j < p; j++) r[i + 1] -= inverse[i * p + j] * a[(j + 1) * k];
    const energy = new Float64Array(count.length), traces = new Float64Array(count.length);
    for (let g = 0; g < count.length; g++) {
      const at = g * k * k;
      let e = 0, t = 0;
      for (let i = 0; i < k; i++) {
        let row = 0;
        for (let j = 0; j < k; j++) row += cross[at + i * k + j] * r[j];
        e += r[i] * row;
        if (i) for (let j = 1; j < k; j++) t += inverse[(i - 1) * p + j - 1] * cross[at + i * k + j];
      }
      energy[g] = e; traces[g] = t;
    }
    return {L, p, r, energy, traces};
  }

  const mixed = (pool, power) => pool.shapes.map(row => row.reduce((s, v, j) => s + v * power[j], 0));

  function likelihood(pool, power) {
    const s = mixed(pool, power), {L, p, r, energy, traces} = normal(pool, s, RIDGE), slope = power.map(() => 0);
    let value = 0;
    s.forEach((v, g) => {
      value -= 0.5 * (pool.count[g] * Math.log(v) + energy[g] / v);
      const d = -0.5 * (pool.count[g] / v - energy[g] / v ** 2) + 0.5 * traces[g] / v ** 2;
      pool.shapes[g].forEach((w, j) => { slope[j] += d * w; });
    });
    for (let i = 0; i < p; i++) value -= Math.log(L[i * p + i]) + 0.5 * r[i + 1] ** 2 * pool.prior[i];
    return {value, slope};
  }

  function nonNegative(A, b, m) { // least squares with coefficients that are not negative: the best of all subsets
    let best = {cost: Infinity, x: new Array(m).fill(0)};
    for (let mask = 0; mask < 1 << m; mask++) {
      const on = [...Array(m).keys()].filter(j => mask >> j & 1), k = on.length, N = new Float64Array(k * k), rhs = new Float64Array(k);
      A.forEach((row, g) => on.forEach((i, a) => { rhs[a] += row[i] * b[g]; on.forEach((j, c) => { N[a * k + c] += row[i] * row[j]; }); }));
      const {inverse} = cholesky(N, k), x = new Array(m).fill(0);
      on.forEach((i, a) => { for (let c = 0; c < k; c++) x[i] += inverse[a * k + c] * rhs[c]; });
      if (x.some(v => v < 0)) continue;
      const cost = A.reduce((s, row, g) => s + (row.reduce((t, v, j) => t + v * x[j], 0) - b[g]) ** 2, 0);
      if (cost < best.cost) best = {cost, x};
    }
    return best.x;
  }

  function scored(pool, power, most) { // Fisher scoring of the terms that may be more than nothing
    const free = power.map((_, j) => j).filter(j => !most || most[j] > 0);
    power = power.map((v, j) => free.includes(j) ? v : NONE);
    let value = likelihood(pool, power).value;
    for (let pass = 0; pass < 25; pass++) {
      const s = mixed(pool, power), {energy, traces} = normal(pool, s, 0);
      const freedom = s.map((v, g) => Math.max(pool.count[g] - traces[g] / v, 0.05 * pool.count[g]));
      const rows = pool.shapes.map((row, g) => free.map(j => row[j] * Math.sqrt(freedom[g]) / s[g]));
      const size = free.map((_, j) => Math.sqrt(rows.reduce((t, row) => t + row[j] ** 2, 0)));
      const b = s.map((v, g) => energy[g] / freedom[g] * Math.sqrt(freedom[g]) / v);
      const part = nonNegative(rows.map(row => row.map((v, j) => v / size[j])), b, free.length);
      let target = power.map(() => 0);
      free.forEach((j, i) => { target[j] = part[i] / size[i]; });
      let gained = 0, tried = power;
      for (let k = 0; k < 6; k++) {
        tried = target.map((v, j) => Math.max(v, 1e-12 * power[j], NONE));
        gained = likelihood(pool, tried).value - value;
        if (gained > 0) break;
        target = target.map((v, j) => 0.5 * (v + power[j]));
      }
      if (!(gained > 0)) break;
      power = tried; value += gained;
      if (gained < 1e-6) break;
    }
    return power;
  }

  function fitNoise(pool, most) {
    const m = pool.shapes[0].length, top = [...Array(m).keys()].map(j => Math.max(...pool.shapes.map(row => row[j])));
    const {energy} = normal({...pool, prior: pool.prior.map(() => 0)}, pool.count.map(() => 1), RIDGE);
    const least = g => Math.max(energy[g], ROUNDING * pool.cross[g * pool.k * pool.k]);
    const scale = top.map((t, j) => Math.max(1e-60, pool.shapes.reduce((s, row, g) => s + row[j] / t * least(g), 0) /
      pool.shapes.reduce((s, row, g) => s + row[j] / t * row[j] * pool.count[g], 0)));
    const low = scale.map(v => Math.log(ABSENT * v)), far = scale.map(v => Math.log(1e4 * v));
    const high = most ? most.map((v, j) => Math.min(Math.max(Math.log(Math.max(v, 1e-300)), low[j]), far[j])) : far;
    const inside = x => x.map((v, j) => Math.min(Math.max(v, low[j]), high[j]));
    let x = inside(scored(pool, scale.map(v => 0.25 * v), most).map((v, j) => Math.log(Math.max(v, 1e-6 * scale[j]))));
    const cost = y => { const p = y.map(Math.exp), {value, slope} = likelihood(pool, p); return {value: -value, slope: slope.map((v, j) => -v * p[j])}; };
    let now = cost(x);
    for (let pass = 0; pass < 30; pass++) { // Newton on the powers that are free to move
      const open = x.map((v, j) => j).filter(j => (x[j] > low[j] || now.slope[j] < 0) && (x[j] < high[j] || now.slope[j] > 0));
      if (!open.some(j => Math.abs(now.slope[j]) > (pass ? 0.1 : 1) * FLAT)) break;
      const k = open.length, H = new Float64Array(k * k);
      open.forEach((j, a) => {
        const step = cost(x.map((v, i) => v + (i === j ? 1e-3 : 0))).slope;
        open.forEach((i, b) => { H[a * k + b] += 5e2 * (step[i] - now.slope[i]); H[b * k + a] += 5e2 * (step[i] - now.slope[i]); });
      });
      for (let a = 0; a < k; a++) H[a * k + a] = Math.max(H[a * k + a], 0) + 1e-3;
      const {inverse} = cholesky(H, k), move = x.map(() => 0);
      open.forEach((j, a) => open.forEach((i, b) => { move[j] -= inverse[a * k + b] * now.slope[i]; }));
      let done = true;
      for (let t = 1, back = 0; back < 2; t *= 0.5) {
        if (t < 1e-3) { back++; t = 1; open.forEach(j => { move[j] = -now.slope[j]; }); }
        const y = inside(x.map((v, j) => v + t * Math.max(-3, Math.min(3, move[j])))), then = cost(y);
        if (then.value < now.value) { done = now.value - then.value < 1e-10; x = y; now = then; break; }
      }
      if (done) break;
    }
    return {power: x.map(Math.exp), loglik: -now.value};
  }

  function coefficients(ready, kept, power) { // modified Gram-Schmidt on whitened rows, the priors as further ones
    const n = ready.mode.lam.length, k = kept.length, weight = ready.mode.shapes.map(s => 1 / Math.sqrt(s.reduce((t, v, j) => t + v * power[j], 0)));
    const rows = kept.map((j, a) => {
      const col = ready.columns[j], x = new Float64Array(n + k);
      for (let i = 0; i < n; i++) x[i] = col.t[i] * weight[i];
      x[n + a] = Math.sqrt(col.p || 0);
      return x;
    });
    const data = new Float64Array(n + k), R = new Float64Array(k * k), beta = new Float64Array(k), inverse = new Float64Array(k * k);
    for (let i = 0; i < n; i++) data[i] = ready.all[0][i] * weight[i];
    const dot = (x, y) => { let s = 0; for (let i = 0; i < n + k; i++) s += x[i] * y[i]; return s; };
    for (let a = 0; a < k; a++) {
      for (let twice = 0; twice < 2; twice++) for (let b = 0; b < a; b++) {
        const s = dot(rows[b], rows[a]);
        R[b * k + a] += s;
        for (let i = 0; i < n + k; i++) rows[a][i] -= s * rows[b][i];
      }
      const size = R[a * k + a] = Math.sqrt(dot(rows[a], rows[a]));
      for (let i = 0; i < n + k; i++) rows[a][i] /= size;
      beta[a] = dot(rows[a], data);
      for (let i = 0; i < n + k; i++) data[i] -= beta[a] * rows[a][i];
    }
    for (let a = k - 1; a >= 0; a--) {
      for (let b = a + 1; b < k; b++) beta[a] -= R[a * k + b] * beta[b];
      beta[a] /= R[a * k + a];
    }
    for (let j = 0; j < k; j++) for (let i = j; i >= 0; i--) {
      let s = i === j ? 1 : 0;
      for (let m = i + 1; m <= j; m++) s -= R[i * k + m] * inverse[m * k + j];
      inverse[i * k + j] = s / R[i * k + i];
    }
    const sd = kept.map((_, i) => Math.sqrt(kept.reduce((s, _, j) => s + inverse[i * k + j] ** 2, 0)));
    return {beta, sd};
  }

  function ownLevels(problem, on, left) { // a run without fitted bins has a level and a scale factor of its own
    const bias = problem.switches.findIndex(s => s.key === 'bias');
    if (!problem.ownLevel || bias < 0 || !on[bias]) return;
    const scale = problem.switches.findIndex((s, k) => s.key === 'scale_factor' && on[k]);
    const fitted = new Set(problem.blocks.filter(b => b.fitted).map(b => b.run));
    for (const run of new Set(problem.blocks.map(b => b.run))) {
      if (fitted.has(run)) continue;
      const bins = problem.blocks.filter(b => b.run === run).flatMap(b => [...Array(b.n).keys()].map(i => b.start + i));
      const bases = [bins.map(() => 1)];
      if (scale >= 0) bases.push(bins.map(i => problem.columns.reduce((s, c) => s + (c.s === scale ? c.x[i] : 0), 0)));
      const known = [];
      for (const base of bases) {
        const size = Math.hypot(...base);
        for (const q of known) { const s = base.reduce((t, v, i) => t + v * q[i], 0); base.forEach((_, i) => { base[i] -= s * q[i]; }); }
        const rest = Math.hypot(...base);
        if (rest > 1e-9 * size) known.push(base.map(v => v / rest));
      }
      for (const q of known) { const s = bins.reduce((t, i, k) => t + left[i] * q[k], 0); bins.forEach((i, k) => { left[i] -= s * q[k]; }); }
    }
  }

  // The model of the switches that are on, its noise fitted anew.
  function solve(ready, on) {
    const {problem, columns} = ready, wanted = columns.map((_, j) => j).filter(j => columns[j].s < 0 || on[columns[j].s]);
    const kept = independent(ready, wanted), pool = pooled(ready, kept), told = problem.known.get(on.map(Number).join(''));
    const {power, loglik} = told ? {power: told.power, loglik: likelihood(pool, told.power).value} : fitNoise(pool, problem.most);
    const {beta, sd} = coefficients(ready, kept, power), left = Float64Array.from(problem.y), theta = [];
    (told ? wanted : kept).forEach(j => { // what insenv found itself is taken as it is
      const c = columns[j], a = kept.indexOf(j), column = j - problem.free.length;
      const value = c.s < 0 ? 0 : told ? told.theta[column] : beta[a] / c.scale;
      if (!value) return;
      theta.push({column, value, sd: a < 0 ? NaN : sd[a] / c.scale});
      for (let i = 0; i < problem.n; i++) left[i] -= value * c.x[i];
    });
    ownLevels(problem, on, left);
    let sum = 0, n = 0;
    for (const b of problem.blocks) if (!b.fitted) for (let i = b.start; i < b.start + b.n; i++) { sum += left[i] ** 2; n++; }
    const variance = ready.held.shapes.map((s, i) => ready.held.scatter[i] ? s.reduce((t, v, j) => t + v * power[j], 0) : 0);
    const floor = Math.sqrt(variance.reduce((s, v) => s + v, 0) / Math.max(variance.length, 1));
    return {left, theta, power, loglik, rms: Math.sqrt(sum / Math.max(n, 1)), floor};
  }

  // The model of a whole unit on a table: the triangle of its fitted cells stands for them; priors follow the noise.
  function unit({triangle, deviations, of, fitted}, on) {
    const k = of.length, n = k + 1, all = [...Array(n).keys()], at = (i, j) => i > j ? 0 : triangle[i * n - i * (i - 1) / 2 + j - i];
    const column = j => all.map(i => at(i, j)), wanted = all.slice(0, k).filter(j => of[j] < 0 || on[of[j]]), y = column(k);
    const rows = wanted.map(column), size = rows.map(t => Math.hypot(...t) || 1), freedom = fitted - wanted.filter(j => of[j] >= 0).length;
    if (freedom < 1) return null;
    let scale = y.reduce((s, v) => s + v * v, 0) / fitted, found, rss, prior;
    for (let pass = 0; pass < 60; pass++) { // beside what the cells do not tell the smallest coefficients
      const columns = rows.map((t, a) => ({t: t.map(v => v / size[a]), p: 1e-16 + (deviations[wanted[a]] ? scale / (deviations[wanted[a]] * size[a]) ** 2 : 0)}));
      const ready = {mode: {lam: all, shapes: all.map(() => [1])}, columns, all: [y]};
      found = coefficients(ready, rows.map((_, a) => a), [1]);
      found.beta.forEach((v, a) => { found.beta[a] = v / size[a]; found.sd[a] /= size[a]; });
      rss = all.reduce((s, i) => s + (y[i] - rows.reduce((t, x, a) => t + x[i] * found.beta[a], 0)) ** 2, 0);
      prior = wanted.reduce((s, j, a) => s + (deviations[j] ? (found.beta[a] / deviations[j]) ** 2 : 0), 0);
      const next = rss / freedom;
      if (Math.abs(next - scale) < 1e-10 * scale) break;
      scale = next;
    }
    const nu = Math.max(freedom, 4), wide = Math.sqrt((rss + scale * prior) / freedom * nu / (nu - 2));
    return {loglik: -0.5 * fitted * Math.log(rss + scale * prior), theta: wanted.map((column, a) => ({column, value: found.beta[a], sd: found.sd[a] * wide}))};
  }

  // Two-sided density of the fitted noise, and its Allan deviation: the integral of the density times the filter.
  const density = (problem, power, f) => f.map(v => problem.width * spectra(problem, Math.min(4, 4 * Math.sin(Math.PI * v * problem.width) ** 2)).reduce((s, w, j) => s + w * power[j], 0));
  function allan(problem, power, counts) {
    const n = 1500, low = Math.log(1e-2 / counts[counts.length - 1]), step = (Math.log(0.5) - low) / n, x = Array.from({length: n}, (_, i) => Math.exp(low + (i + 0.5) * step));
    const s = density(problem, power, x.map(v => v / problem.width));
    return counts.map(m => Math.sqrt(x.reduce((t, v, i) => t + 4 * s[i] / problem.width * Math.sin(Math.PI * v * m) ** 4 / (m * Math.sin(Math.PI * v)) ** 2 * v * step, 0)));
  }

  return {unpack, prepare, solve, unit, density, allan, fft};
})();
