// The problem of a target as the fit wants it, from what the page holds.
async function problemOf(T) {
  const a = await GLS.unpack(T.data, T.parts);
  if (T.models) { // each fitted beforehand
    const fits = new Map(T.models.map((m, k) => [m.on, {left: a['m' + k], rms: m.rms ?? NaN, floor: m.floor ?? NaN, loglik: m.loglik, theta: m.theta.map(([column, value, sd]) => ({column, value, sd: sd ?? NaN}))}]));
    return {arrays: a, solve: on => fits.get(on.map(Number).join(''))};
  }
  const [low, high, n] = T.lam;
  const columns = T.columns.map((c, k) => ({x: a['c' + k], step: T.parts.find(p => p[0] === 'c' + k)[2], prior: c.prior === null ? Infinity : c.prior, s: c.s}));
  const y = Float64Array.from(a.after);
  T.columns.forEach((c, k) => { if (c.theta) for (let i = 0; i < T.n; i++) y[i] += c.theta * columns[k].x[i]; });
  const lam = Float64Array.from({length: n}, (_, i) => low * (high / low) ** (i / (n - 1)));
  return {n: T.n, y, columns, lam, spectra: Float64Array.from(T.spectra.flat()), terms: T.terms, width: T.width,
    blocks: T.blocks, free: T.free, most: T.most, known: new Map(T.known), ownLevel: T.ownLevel, switches: T.switches, arrays: a};
}
