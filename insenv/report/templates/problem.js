// The problem of a target as the fit wants it, from what the page holds.
async function problemOf(T, whole) {
  const a = await GLS.unpack(T.data, T.parts);
  if (T.models) { // each fitted beforehand
    const fits = new Map(T.models.map((m, k) => [m.on, {left: a['m' + k], rms: m.rms ?? NaN, floor: m.floor ?? NaN, loglik: m.loglik, theta: m.theta.map(([column, value, sd]) => ({column, value, sd: sd ?? NaN}))}]));
    return {arrays: a, solve: on => fits.get(on.map(Number).join(''))};
  }
  if (T.whole) { // a channel of a unit that is fitted as one
    const solve = on => {
      const fit = GLS.unit(whole, on), left = Float64Array.from(a.after), moved = T.columns.map(c => c.theta), held = T.blocks.filter(b => !b.fitted);
      if (!fit) return null;
      fit.theta.forEach(t => { moved[t.column] -= t.value; });
      moved.forEach((v, k) => { if (v) a['c' + k].forEach((x, i) => { left[i] += v * x; }); });
      const squares = held.flatMap(b => [...left.subarray(b.start, b.start + b.n)]).map(v => v * v), shown = fit.theta.filter(t => T.columns[t.column].f);
      return {left, loglik: fit.loglik, floor: T.floor ?? NaN, rms: Math.sqrt(squares.reduce((s, v) => s + v, 0) / squares.length),
        theta: shown.map(({column, value, sd}) => ({column, value: value * T.columns[column].f, sd: sd * Math.abs(T.columns[column].f)}))};
    };
    return {arrays: a, solve};
  }
  const [low, high, n] = T.lam;
  const columns = T.columns.map((c, k) => ({x: a['c' + k], step: T.parts.find(p => p[0] === 'c' + k)[2], prior: c.prior === null ? Infinity : c.prior, s: c.s}));
  const y = Float64Array.from(a.after);
  T.columns.forEach((c, k) => { if (c.theta) for (let i = 0; i < T.n; i++) y[i] += c.theta * columns[k].x[i]; });
  const lam = Float64Array.from({length: n}, (_, i) => low * (high / low) ** (i / (n - 1)));
  return {n: T.n, y, columns, lam, spectra: Float64Array.from(T.spectra.flat()), terms: T.terms, width: T.width,
    blocks: T.blocks, free: T.free, most: T.most, known: new Map(T.known), ownLevel: T.ownLevel, switches: T.switches, arrays: a};
}
