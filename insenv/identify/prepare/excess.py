"""Is what is left noise? Some tests, so that slow structure is not swallowed by the noise model.

1. Excess over the declared noise: twice the gain in likelihood of noise fitted freely over noise held to at most what
   the maker declares (with a tolerance, for declared figures are not exact). A noise term that is not declared counts
   as absent, except quantisation and what an effect of the model carries along from the channels it is made of.
   And the power in bands of frequency over the most that was declared, for what is in one band alone.
2. Shape: in groups of modes the whitened power over its expectation is chi-square; its largest deviation, and the
   largest distance of the cumulated periodogram from a straight line, show a hump that no noise term can follow.
3. Loudness: transformed back, the whitened residual is white in time; its power in windows of some bins and more, over
   a tolerance, shows what comes and goes. Single bins count for no more than three standard deviations.
   And with the rate: its means over some bins are louder where the table turns faster, more clearly than bins are, as
   errors of a reference would be.
   And with its changes: a mean over them (`insenv.identify.prepare.after_moves`).
4. Angle: waves of the table's angle of any order, in windows of time (`insenv.identify.prepare.spectral.orders`).
   Temperature: the same, half of its range the turn.
   Runs: whether one wanders more than the others (`insenv.identify.prepare.alike`).
5. Lines that move (`insenv.identify.prepare.spectral.sweeps`).
   Points: whether readings at one setting agree better with each other, and go on from row to row
   (`insenv.identify.prepare.lack_of_fit`).
6. Held-out data: the same in groups of their modes, with the noise of the fitted data: what sets in after the fit.

Loudness, bands, angle and lines that move are judged on all rows, the model fitted anew to all of them: what these
tests see goes on in the held-out ones, and no model is chosen by them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import idct
from scipy.special import chdtr, chdtrc, fdtrc, kolmogorov, ndtr

from insenv.core.lazy import Lazy
from insenv.core.recording import Floats
from insenv.core.series.allan import QUANTIZATION, WHITE
from insenv.identify.fit.bins import Block
from insenv.identify.fit.evidence import HELD_OUT_SPREAD, held_out_modes
from insenv.identify.fit.gls import Fit, noise_freedom, solve, spectrum, whitened
from insenv.identify.fit.noise import eigenvalues, fit_noise, modes, transform
from insenv.identify.fit.problem import NOISE_TERMS, Problem, pooled
from insenv.identify.prepare import lack_of_fit
from insenv.identify.prepare.after_moves import after_moves_p
from insenv.identify.prepare.alike import Unlike, most_unlike
from insenv.identify.prepare.spectral.orders import AS_WELL, MOST_ORDER, Wave, order_of, strongest
from insenv.identify.prepare.spectral.sweeps import sweeps_p

#: Blocks with their whitened residuals in time.
Blocks = tuple[tuple[Block, Floats], ...]
#: Declared coefficients are taken as known to this share.
TOLERANCE = 0.15
#: Bins of the shortest window, the share by which noise may be louder there, and what one bin counts at most.
SHORTEST_WINDOW, LOUDER, LOUDEST = 8, 1.3, 3.0
#: Fewest means that are compared with the rate, and doublings of a bin from which on they are slow.
FEWEST_FAST, SLOW_FROM = 60, 2
#: Eigenvalue below which a mode is slow: periods of more than about 60 bins.
SLOW = 0.01
#: Share of the table's rate that an axis sees at least where it tells how far the table has turned.
LEAST_ALONG = 0.1
#: How often the tests are tried on what the steps of an encoder, or counts of the reading, and noise leave.
TRIALS = 8
#: Shares of the white noise with which counts are tried.
OF_WHITE = (1.0, 0.5, 0.2, 0.1)
#: Turns that the range of the temperature is.
TURNS = 2.0
#: Modes of the narrowest band, and the bands of one width that are tried from the lowest frequency on.
NARROWEST, BANDS = 4, 8


#: What four of the tests say, of which a wave of the table's angle may explain two, and from which probability on its
#: order is told.
OF_ANGLE = "the residual follows the table's angle in a way that no effect foresees"
OF_TEMPERATURE = "the residual follows the temperature in a way that no effect foresees"
MOVING = "the residual has a line whose frequency moves, which no effect has"
LOUD = "the residual is louder at some times than at others"
UNLIKE = "one of the runs wanders more than the others, which noise of one instrument does not"
TOLD = 1e-6


@dataclass(frozen=True)
class Structure:
    """What speaks against "only noise is left"; ``reasons`` is empty if nothing does."""

    p_value: float
    reasons: tuple[str, ...]


def structure(problem: Problem, fit: Fit, declared: dict[str, float], alpha: float) -> Structure:
    """Test the residual of a fit against the declared noise (by effect id, SI) and against any noise."""
    key = ("structure", tuple(sorted(declared.items())), alpha)
    found: Structure = problem.remember_last(key, fit, lambda: _structure(problem, fit, declared, alpha))
    return found


def _structure(problem: Problem, fit: Fit, declared: dict[str, float], alpha: float) -> Structure:
    tests = _tests(problem, fit, declared)
    level = alpha / len(tests)
    if min(tests.values()) < level:
        least = _of_steps(problem, fit)
        tests = {text: beside_steps(p, least.get(text, 1.0)) for text, p in tests.items()}
    found = {text: p for text, p in tests.items() if p < level}
    wave = Lazy(lambda: _strongest_wave(problem, fit))
    each = {text: _each_turn(wave, text, p) if problem.turns else "" for text, p in found.items()}
    if UNLIKE in found and (unlike := _unlike(*_whole(problem, fit))) is not None:
        each[UNLIKE] = f", run {unlike.run + 1} by {unlike.times:.2g} times as much"
    each |= {OF_TEMPERATURE: _each_wave_of_heat(problem, fit)} if OF_TEMPERATURE in found else {}
    reasons = (f"{text}{each[text]} (p = {p:.1g})" for text, p in found.items())
    return Structure(min(tests.values()), tuple(reasons))


def beside_steps(p: float, least: float) -> float:
    """A p-value as it is where steps and noise alone have made one as small as ``least`` in `TRIALS` recordings.

    What is louder than a test presumes makes the logarithm of all its p-values so many times as large.
    """
    by_chance = 1 / (TRIALS + 1)
    return p if least >= by_chance or p >= 1 else float(p ** (np.log(by_chance) / np.log(max(least, 1e-300))))


def _of_steps(problem: Problem, fit: Fit) -> dict[str, float]:
    """The smallest p-value of each test where steps of the encoder, or counts of the reading, and noise are left.

    At a steady rate they are lines, on a swing lines whose frequency moves, and of a hand's motion slow structure.
    """
    least: dict[str, float] = {}
    for y in (*_beside_an_encoder(problem, fit), *_counted(problem, fit)):
        made = problem.measured_as(y)
        for text, p in _tests(made, solve(made, fit.model, start=fit.noise.power), {}).items():
            least[text] = min(p, least.get(text, 1.0))
    return least


def _beside_an_encoder(problem: Problem, fit: Fit) -> Iterator[Floats]:
    """Means that the model, noise and the steps of an encoder that begins elsewhere make, shape (bins,) each."""
    errors = problem.step_errors()
    if errors is None:
        return
    power = fit.noise.power.copy()
    power[_place(QUANTIZATION)] = max(power[_place(QUANTIZATION)] - problem.encoder**2 / 12, 0.0)
    rng, model = np.random.default_rng(len(problem.y)), fit.predicted()
    for draw in errors[:: len(errors) // TRIALS]:
        yield model - draw + _noise(problem, power, rng)


def _counted(problem: Problem, fit: Fit) -> Iterator[Floats]:
    """Means of what a counter reads of the model and white noise, its zero elsewhere each time, shape (bins,) each.

    The white noise that was fitted may hold what counts make, of rates that are nearly whole counts a row: parts of it
    are tried too (`OF_WHITE`). Slower noise is added to the means: within a count it changes nothing.
    """
    if not problem.counter:
        return
    rng, model, white = np.random.default_rng(len(problem.y)), fit.predicted(), _place(WHITE)
    slow = np.where(np.arange(len(NOISE_TERMS)) == white, 0.0, fit.noise.power)
    slow[_place(QUANTIZATION)] = 0.0
    for trial in range(TRIALS):
        spread = np.sqrt(fit.noise.power[white]) * OF_WHITE[trial % len(OF_WHITE)]
        read = []
        for run, exposure in enumerate(problem.exposures):
            dt, own = exposure.motion.dt, problem.bins.run == run
            at = (np.arange(len(exposure.u)) + 0.5) * dt
            rate = exposure.motion.rate + np.interp(at, problem.bins.time[own], model[own])
            turned = np.cumsum(rate * dt + spread * np.sqrt(dt) * rng.standard_normal(len(rate)))
            counts = np.floor(np.concatenate([[0.0], turned]) / problem.counter + rng.random())
            read.append(np.diff(counts) * problem.counter / dt - exposure.motion.rate)
        yield problem.bins.mean(tuple(read)) + _noise(problem, slow, rng)


def _noise(problem: Problem, power: Floats, rng: np.random.Generator) -> Floats:
    """Noise of the means of each block, shape (bins,)."""
    out = np.zeros(problem.bins.n)
    for block in problem.bins.blocks:
        spread = np.sqrt(modes((block,), NOISE_TERMS, problem.bins.width).shapes @ power)
        out[block.start : block.stop] = idct(spread * rng.standard_normal(block.n), type=2, norm="ortho")
    return out


def _tests(problem: Problem, fit: Fit, declared: dict[str, float]) -> dict[str, float]:
    """P-values of the tests, by what each says."""
    _, q, residual = whitened(problem, fit)
    whole, all_rows = _whole(problem, fit)
    everywhere = tuple(_in_time(whole, whitened(whole, all_rows)[2]))
    tests = [
        (
            "the residual's spectrum has a hump or line that the noise model cannot follow",
            _shape_p(problem, q, residual),
        ),
        (LOUD, _loudness_p(everywhere)),
        ("slow noise is louder where the table turns faster, which no noise term is", _fast_p(whole, everywhere)),
        (
            "what is left repeats at each change of the motion, as what rings or settles does",
            after_moves_p(whole, everywhere),
        ),
        (OF_ANGLE, _strongest_wave(problem, fit).p_value if _turned(whole, everywhere) else 1.0),
        (OF_TEMPERATURE, strongest(_heated(whole, everywhere)).p_value),
        (MOVING, sweeps_p(_by_run(whole, everywhere))),
        ("held-out data hold slow structure that neither model nor noise foretells", _later_p(problem, fit)),
    ]
    if (unlike := _unlike(whole, all_rows)) is not None:
        tests.append((UNLIKE, unlike.p_value))
    if problem.in_points:
        tests += lack_of_fit.tests(whole, all_rows)
    if declared:
        bands = _bands_p(whole, all_rows, declared)
        # Beside counts of an encoder noise that is free takes what these leave for more of its own.
        excess = bands if problem.step_errors() is not None else 2 * min(_excess_p(problem, fit, declared), bands)
        tests.append(("the residual holds more noise than was declared", excess))
    return dict(tests)


def _unlike(problem: Problem, fit: Fit) -> Unlike | None:
    """The run that wanders most, of several."""
    return None if problem.in_points else most_unlike(problem.fitted, whitened(problem, fit)[2])


def broad_p(problem: Problem, fit: Fit) -> float:
    """P-value of a broad hump of the spectrum, one that is no line: no mode counts for more than three sd."""
    _, q, residual = whitened(problem, fit)
    order = np.argsort(problem.modes().lam)
    power = np.minimum(residual[order] ** 2, LOUDEST**2)
    return _cumulated_p(power, (1 - np.sum(q**2, axis=1))[order])


def _whole(problem: Problem, fit: Fit) -> tuple[Problem, Fit]:
    """The problem with all blocks fitted, and the model's fit to it."""
    if not problem.held_out:
        return problem, fit

    def made() -> tuple[Problem, Fit]:
        whole = problem.all_fitted()
        return whole, solve(whole, fit.model, start=fit.noise.power)

    found: tuple[Problem, Fit] = problem.remember_last("all rows fitted", fit, made)
    return found


def _excess_p(problem: Problem, fit: Fit, declared: dict[str, float]) -> float:
    pooled_model = pooled(problem, fit.model)
    free = fit_noise(*pooled_model, restricted=True, start=fit.noise.power)
    most = _most_carried(problem, fit, declared)
    held = fit_noise(*pooled_model, restricted=True, most=most)
    ratio = max(0.0, 2 * (free.loglik - held.loglik))
    return float(chdtrc(int(np.isfinite(most).sum()), ratio))


def _most_carried(problem: Problem, fit: Fit, declared: dict[str, float]) -> Floats:
    """Largest declared powers, with what the model's effects carry along and what lost rows leave."""
    most = most_power(declared)
    for carried in {name for term in fit.model for name in term.effect.carries}:
        most[_place(carried)] = np.inf  # the noise of another channel, of which no figure is told
    # Where rows were lost the angle errors of counts do not cancel: two of them are left at each loss.
    most[_place(WHITE)] += 2 * _lost(problem) * _most(QUANTIZATION, {QUANTIZATION: 0.0, **declared})
    return most


def _bands_p(problem: Problem, fit: Fit, declared: dict[str, float]) -> float:
    """Power in bands over what the largest declared noise and steps of an encoder have there; levels left out."""
    most = _most_carried(problem, fit, declared)
    held = fit_noise(*pooled(problem, fit.model), restricted=True, most=most)
    loudest = replace(held, power=np.where(np.isfinite(most), most, held.power))
    _, _, residual = whitened(problem, replace(fit, noise=loudest))
    within = eigenvalues(problem.fitted) > 0
    errors = problem.step_errors()
    if errors is not None:
        own = spectrum(problem, loudest.power)
        residual = residual / np.sqrt(1 + np.mean(transform(problem.fitted, errors.T) ** 2, axis=1) / own)
    power = residual[within][np.argsort(problem.modes().lam[within], kind="stable")] ** 2
    total, tails, width = np.concatenate([[0.0], np.cumsum(power)]), [1.0], NARROWEST
    while 2 * width <= len(power):
        first = np.arange(0, min(len(power) - width, BANDS * width) + 1, width // 2)
        tails += list(chdtrc(width, total[first + width] - total[first]))
        width *= 2
    return float(min(1.0, min(tails) * len(tails)))


def _place(term: str) -> int:
    return [one.id for one in NOISE_TERMS].index(term)


def _lost(problem: Problem) -> float:
    """How often rows are missing [1/s]."""
    losses, time = 0, 0.0
    for exposure in problem.exposures:
        short = exposure.count < exposure.count.max(initial=0)
        losses += int(np.sum(short[1:] & ~short[:-1]))
        time += len(short) * exposure.motion.dt
    return losses / time


def most_power(declared: dict[str, float]) -> Floats:
    """Largest power of each of `NOISE_TERMS` that declared noise (by effect id, SI) admits; it may be infinite."""
    return np.array([_most(term.id, declared) for term in NOISE_TERMS])


def _most(term: str, declared: dict[str, float]) -> float:
    if term in declared:
        return (declared[term] * (1 + TOLERANCE)) ** 2
    return np.inf if term == QUANTIZATION else 0.0


def _shape_p(problem: Problem, q: Floats, residual: Floats) -> float:
    """Smaller of the two shape tests' p-values, doubled."""
    order = np.argsort(problem.modes().lam)
    # What the model took out of the lowest modes is missing there: expectation 1 - leverage.
    expected = (1 - np.sum(q**2, axis=1))[order]
    power = residual[order] ** 2
    return float(min(1.0, 2 * min(_group_p(power, expected), _cumulated_p(power, expected))))


def _in_time(problem: Problem, residual: Floats) -> Iterator[tuple[Block, Floats]]:
    """The whitened residual of each fitted block transformed back: white in time."""
    start = 0
    for block in problem.fitted:
        yield block, idct(residual[start : start + block.n], type=2, norm="ortho")
        start += block.n


def _by_run(problem: Problem, blocks: Blocks) -> tuple[Floats, ...]:
    """Whitened residual at the bins of each run, from its first to its last one; zero where there is none."""
    place = np.concatenate(problem.bins.kept)
    out = []
    for run in dict.fromkeys(block.run for block, _ in blocks):
        own = [(place[b.start : b.stop], white) for b, white in blocks if b.run == run]
        at, values = (np.concatenate(parts) for parts in zip(*own, strict=True))
        series = np.zeros(int(np.ptp(at)) + 1)
        series[at - at.min()] = np.clip(values, -LOUDEST, LOUDEST)
        out.append(series)
    return tuple(out)


def order_of_line(problem: Problem, fit: Fit, frequency: float) -> int:
    """Times a turn of the table that a line at ``frequency`` [Hz] of what is left comes, if it goes along; else 0.

    Where its rate alone was logged, the angle is the integral of that.
    """
    turned = _along(problem, tuple(_in_time(problem, whitened(problem, fit)[2])))
    times = [problem.bins.time[b.start : b.stop] for b, _ in turned]
    return order_of([block for _, block in turned], times, frequency)


def _along(problem: Problem, blocks: Blocks) -> list[tuple[Block, tuple[Floats, Floats, Floats]]]:
    """The same as `_turned`, by the integral of the rate where no angle was logged."""
    along = [(b, white) for b, white in blocks if abs(problem.exposures[b.run].motion.projection) > LEAST_ALONG]
    return _turned(problem, blocks) or [(b, (white, *_integrated(problem, b))) for b, white in along]


def _integrated(problem: Problem, block: Block) -> tuple[Floats, Floats]:
    """The angle of a table in the middle of the bins of a block, since the start of its run, and by how much it turns.

    Turns while no bin is used count at the rates before and after.
    """
    of_run = problem.bins.run == block.run
    rate = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    rate /= problem.exposures[block.run].motion.projection
    u, steps = rate[of_run], np.diff(problem.bins.time[of_run])
    angle, own = np.zeros(len(rate)), slice(block.start, block.stop)
    angle[of_run] = np.append(0.0, np.cumsum(0.5 * (u[1:] + u[:-1]) * steps))
    return angle[own], rate[own] * problem.bins.width


def _strongest_wave(problem: Problem, fit: Fit) -> Wave:
    """The wave of the angle that what is left follows best; of the integral of the rate where no angle was logged."""

    def made() -> Wave:
        whole, all_rows = _whole(problem, fit)
        return strongest([block for _, block in _along(whole, tuple(_in_time(whole, whitened(whole, all_rows)[2])))])

    found: Wave = problem.remember_last("strongest wave", fit, made)
    return found


def order_left(problem: Problem, fit: Fit, declared: dict[str, float], alpha: float) -> int:
    """Whole times a turn of the table that a wave comes which what is left follows; 0 where none is told.

    Beyond `TOLD`, for all orders of `insenv.identify.prepare.spectral.orders` are tried.
    """
    wave = _strongest_wave(problem, fit)
    if wave.p_value >= TOLD or wave.order >= MOST_ORDER or wave.order % 1:
        return 0
    told = any(reason.startswith(OF_ANGLE) for reason in structure(problem, fit, declared, alpha).reasons)
    return int(wave.order) if told else 0


def _each_turn(wave: Callable[[], Wave], text: str, p: float) -> str:
    """How often a turn a wave comes that what is left follows as well as a test says, the end of a sentence.

    A motor's poles, a gear or an encoder make such waves.
    """
    if text not in (OF_ANGLE, MOVING):
        return ""
    found = wave()
    as_well = np.log(max(found.p_value, 1e-300)) <= AS_WELL * np.log(max(p, 1e-300))
    told = as_well and found.p_value < TOLD and found.order < MOST_ORDER
    return f", {found.order:.3g} times a turn of the table" if told else ""


def _each_wave_of_heat(problem: Problem, fit: Fit) -> str:
    """By how much the temperature changes in a wave of it that what is left follows, the end of a sentence."""
    whole, all_rows = _whole(problem, fit)
    heat = whole.heat()
    wave = strongest(_heated(whole, tuple(_in_time(whole, whitened(whole, all_rows)[2]))))
    if heat is None or not wave.order or wave.p_value >= TOLD:
        return ""
    return f", as a wave of {float(np.ptp(heat)) / TURNS / wave.order:.2g} K"


def _turned(problem: Problem, blocks: Blocks) -> list[tuple[Block, tuple[Floats, Floats, Floats]]]:
    """Blocks in which a table turns: what is left, the angle in the middle of each bin, and by how much it turns."""
    angles = {b.run: problem.exposures[b.run].motion.angle for b, _ in blocks}
    moving = [(b, white) for b, white in blocks if (a := angles[b.run]) is not None and np.ptp(a)]
    if not moving:
        return []
    middle, change = problem.bins.mean(
        tuple(
            np.column_stack([0.5 * (e.motion.angle[1:] + e.motion.angle[:-1]), np.diff(e.motion.angle)])
            if e.motion.angle is not None
            else np.zeros((e.motion.n, 2))
            for e in problem.exposures
        )
    ).T
    per_bin = {block.run: problem.bins.width / problem.exposures[block.run].motion.dt for block, _ in moving}
    found = []
    for b, white in moving:
        own = slice(b.start, b.stop)
        found.append((b, (np.clip(white, -LOUDEST, LOUDEST), middle[own], change[own] * per_bin[b.run])))
    return found


def _heated(problem: Problem, blocks: Blocks) -> list[tuple[Floats, Floats, Floats]]:
    """What is left, and the temperature as an angle, half of its range a turn; nothing where it was not recorded.

    A block tells a wave if it turns once: of two blocks hardly one has the whole range.
    """
    heat = problem.heat()
    span = 0.0 if heat is None else float(np.ptp(heat))
    if heat is None or not span:
        return []
    angle = 2 * np.pi * TURNS * (heat - heat.min()) / span
    rows = [(slice(block.start, block.stop), np.clip(white, -LOUDEST, LOUDEST)) for block, white in blocks]
    return [(white, angle[own], np.gradient(angle[own])) for own, white in rows if len(white) > 1]


def _loudness_p(blocks: Blocks) -> float:
    """Excess power of the whitened residual in windows of time."""
    tails = [1.0]
    for block, white in blocks:
        power = np.minimum(white**2, LOUDEST**2)
        total = np.concatenate([[0.0], np.cumsum(power)])
        width = SHORTEST_WINDOW
        while 3 * width <= block.n:
            first = np.arange(0, block.n - width + 1, width // 2)
            tails.append(float(chdtrc(width, (total[first + width] - total[first]).max() / LOUDER)))
            width *= 2
    windows = sum(4 * block.n / SHORTEST_WINDOW for block, _ in blocks)
    return float(min(1.0, min(tails) * windows))


def _fast_p(problem: Problem, blocks: Blocks) -> float:
    """Whether means over some bins of the whitened residual are louder where the table turns faster, by ranks.

    Errors of a reference, such as late stamps, are louder there too: in single bins first of all.
    """
    if not problem.turns:
        return 1.0
    rate = np.abs(problem.bins.mean(tuple(e.u for e in problem.exposures)))
    found, count = [], 1
    while sum(block.n // count for block, _ in blocks) >= FEWEST_FAST:
        found.append(_louder_where_fast(blocks, rate, count))
        count *= 2
    slow = found[SLOW_FROM:]
    if not slow or max(slow) <= found[0]:
        return 1.0
    return float(min(1.0, ndtr(-max(slow)) * len(slow)))


def _louder_where_fast(blocks: Blocks, rate: Floats, count: int) -> float:
    """Deviate by which means over ``count`` bins go with the rate in rank; none that is not `LOUDER` is positive."""
    power, means = [], []
    for block, white in blocks:
        n = block.n // count
        power.append(np.sum(white[: n * count].reshape(n, count), axis=1) ** 2 / count)
        means.append(np.mean(rate[block.start : block.start + n * count].reshape(n, count), axis=1))
    loud, fast = np.minimum(np.concatenate(power), LOUDEST**2), np.concatenate(means)
    rank = np.argsort(np.argsort(fast)) / len(fast) - 0.5
    ratio = loud[rank > 1 / 6].mean() / max(float(loud[rank < -1 / 6].mean()), 1e-300)
    deviate = float(rank @ (loud - loud.mean()) / np.sqrt((rank @ rank) * max(float(loud.var()), 1e-300)))
    return deviate if ratio > LOUDER else min(deviate, 0.0)


def _later_p(problem: Problem, fit: Fit) -> float:
    """Excess power in groups of held-out modes, slow ones; levels left out, for they may wander."""
    lam, r = held_out_modes(problem, fit)
    slow = np.flatnonzero((lam > 0) & (lam < SLOW))
    slow = slow[np.argsort(lam[slow])]
    if len(slow) < 8:
        return 1.0
    power, fitted = r[slow] ** 2 / HELD_OUT_SPREAD**2, problem.modes().lam
    tails = []
    for group in np.split(np.arange(len(slow)), np.unique(np.geomspace(2, len(slow), 10).astype(int))[:-1]):
        low, high = lam[slow[group[0]]], lam[slow[group[-1]]]
        beside = (fitted >= 0.5 * low) & (fitted <= 2 * high)
        freedom = noise_freedom(problem, fit.noise.power, beside.astype(float)) if beside.any() else 2.0
        tails.append(float(fdtrc(len(group), freedom, power[group].mean())))
    return min(1.0, min(tails) * len(tails))


def _group_p(power: Floats, expected: Floats, groups: int = 40) -> float:
    edges = np.unique(np.geomspace(1, len(power), groups).astype(int))
    total = np.diff(np.cumsum(power)[edges - 1])
    freedom = np.diff(np.cumsum(expected)[edges - 1])
    usable = freedom > 2
    tail = np.minimum(chdtrc(freedom[usable], total[usable]), chdtr(freedom[usable], total[usable]))
    return float(min(1.0, 2 * tail.min() * usable.sum())) if usable.any() else 1.0


def _cumulated_p(power: Floats, expected: Floats) -> float:
    """Kolmogorov-Smirnov distance of the cumulated periodogram; the variance of chi-square on one degree is 2."""
    if not np.any(power):  # all readings but outliers are one number
        return 1.0
    share = np.cumsum(power) / np.sum(power) - np.cumsum(expected) / np.sum(expected)
    return float(kolmogorov(np.abs(share).max() * np.sqrt(len(power) / 2)))
