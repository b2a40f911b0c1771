"""What closing the loop found: plain frozen results, ready to be written as JSON or drawn.

All numbers are SI. Nothing here estimates; `insenv.identify.loop` fills it, `insenv.report` shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.filing import Filing
from insenv.core.lazy import nothing, unanswered
from insenv.core.recording import Floats, Mounting, Recording, Site
from insenv.data.fingerprint import fingerprint
from insenv.data.manifest.spec import Manifest


@dataclass(frozen=True)
class Estimate:
    """One estimated parameter: ``parameter`` of ``effect`` with value and standard deviation, SI ``unit``."""

    effect: str
    parameter: str
    value: float
    sd: float
    unit: str


@dataclass(frozen=True)
class Covariance:
    """Covariance of all parameters of a fit together, SI.

    ``names`` has (effect's key, parameter), "c[2]" for one of run 2; ``values`` and ``matrix`` go with it, shapes (p,)
    and (p, p).
    """

    names: tuple[tuple[str, str], ...]
    values: Floats
    matrix: Floats


@dataclass(frozen=True)
class HeldOut:
    """Root mean square of the residual on data that no fit saw, as means over ``averaging`` seconds.

    ``noise_floor`` is what the fitted noise alone would leave. ``of`` says in words of what else than such means the
    error is: "rotations from rest to rest".
    """

    before: float
    after: float
    noise_floor: float
    unit: str
    averaging: float
    of: str = ""


#: How a reason names what a search finds as often in residuals whose values have signs by chance.
BY_SIGNS = "may be chance: with signs by chance the search finds as much in the residual"


@dataclass(frozen=True)
class WholeError:
    """How often a whole search finds as much in noise alone, by signs (`insenv.identify.search.whole.error`).

    ``p`` is (1 + k) / (draws + 1), k of ``draws`` residuals of chance with as much evidence or more; ``agrees`` says
    whether that count is one which the p-value with looks counted lets expect, or fewer.
    """

    p: float
    draws: int
    agrees: bool

    @property
    def least(self) -> bool:
        """Whether no residual of chance had as much: ``p`` is the smallest that so many can say."""
        return self.p * (self.draws + 1) < 1.5


@dataclass(frozen=True)
class Added:
    """An effect that the model lacked, on one target; ``runs``, counted from 1, where it is not one of all runs.

    ``unit`` is that of its held-out errors where it is another than that of the target's. ``indirect``: no residual
    shows it, and its least size alone is known. ``same_curve`` are effects that no data of this kind tell from it.
    ``whole`` is the error of the whole search for it, made when it is asked for; it gives None where none is known.
    """

    effect: str
    order: int | None
    parameters: tuple[Estimate, ...]
    p_value: float
    likelihood_ratio: float
    confounded_with: tuple[str, ...]
    held_out_before: float
    held_out_after: float
    generic: bool = False
    remark: str = ""
    runs: tuple[int, ...] = ()
    unit: str = ""
    indirect: bool = False
    same_curve: tuple[str, ...] = ()
    whole: Callable[[], WholeError | None] = field(default=nothing, compare=False, repr=False)


@dataclass(frozen=True)
class Detectable:
    """The smallest amplitude that would have been found with 95 % probability: parameter, value, SI unit.

    ``at`` has the shapes for which it holds: name to value and SI unit.
    """

    name: str
    value: float
    unit: str
    at: Mapping[str, tuple[float, str]]


def _unsaid() -> None:
    """Nothing is said of how small an effect would have been found."""


@dataclass(frozen=True)
class Rejected:
    """A candidate that was tried and not added; ``reason`` is "not significant", "held-out worse", ...

    ``least`` says how small an effect would have been found; it costs a fair part of a search, and is asked once, by
    whoever shows it.
    """

    effect: str
    p_value: float
    likelihood_ratio: float
    reason: str
    least: Callable[[], Detectable | None] = field(default=_unsaid, compare=False, repr=False)

    @property
    def smallest_detectable(self) -> Detectable | None:
        """The smallest amplitude that would have been found; None where nothing is said."""
        return self.least()


@dataclass(frozen=True)
class NotTestable:
    """An effect that this recording cannot show, and the channels or conditions that it would need."""

    effect: str
    needs: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True)
class Derived:
    """A quantity that the user wants, computed from the estimates before and after: ``name`` in SI ``unit``."""

    name: str
    unit: str
    before: Estimate
    after: Estimate


@dataclass(frozen=True)
class Pair:
    """How clearly a procedure would tell two effects apart, in standard deviations."""

    effects: tuple[str, str]
    sigma: float


@dataclass(frozen=True)
class NextExperiment:
    """A procedure that would tell the effects of ``separates`` apart.

    Attributes
    ----------
    separates : tuple of str
    procedure : str
    expected_separation_sigma : float, optional
        The smallest over the pairs; None where it cannot be computed: ``procedure`` says why.
    profile : mapping, optional
        What a table or a vehicle would do: the keys of a scenario's ``[profile]``, quantities as texts with units.
    changes : mapping, optional
        What else of a scenario would be another, and ``base_turned``, the angle that the base is turned by.
    pairs : tuple of Pair
    control : bool
        Whether it is a plain repeat.
    """

    separates: tuple[str, ...]
    procedure: str
    expected_separation_sigma: float | None
    profile: Mapping[str, str | int | Sequence[str | Sequence[str]]] | None = None
    changes: Mapping[str, Any] | None = None
    pairs: tuple[Pair, ...] = ()
    control: bool = False


@dataclass(frozen=True)
class Spectra:
    """Spectral density and Allan deviation of a residual, and what the noise models say of them.

    ``psd_*`` two-sided densities at ``f`` [Hz]; ``allan_*`` deviations at ``tau`` [s]; ``*_fitted`` from the fitted
    noise, ``*_declared`` from the maker's figures (None where none were declared). ``lower``/``upper`` are 68 %. All
    are empty where there is no series in time, as of rests in several positions.
    """

    f: Floats
    psd_before: Floats
    psd_after: Floats
    psd_fitted: Floats
    psd_declared: Floats | None
    tau: Floats
    allan_before: Floats
    allan_after: Floats
    allan_lower: Floats
    allan_upper: Floats
    allan_fitted: Floats
    allan_declared: Floats | None


_NONE = np.zeros(0)
#: Of what has no samples in time, as means of rests.
NO_SPECTRA = Spectra(_NONE, _NONE, _NONE, _NONE, None, _NONE, _NONE, _NONE, _NONE, _NONE, _NONE, None)


@dataclass(frozen=True)
class Traces:
    """Residuals bin by bin, to be drawn against what may explain them; every array has shape (n_bins,).

    ``covariates`` maps "temperature" [K], "rate" [rad/s], "angle" [rad, within one turn] to values, where known.
    ``run`` counts from 1; ``held_out`` marks bins that no fit saw.
    """

    t: Floats
    run: NDArray[np.int64]
    held_out: NDArray[np.bool_]
    before: Floats
    after: Floats
    covariates: Mapping[str, Floats]


@dataclass(frozen=True)
class SampleSpectrum:
    """Two-sided density of the samples up to ``nyquist`` [Hz]: mean and largest value in narrow bins around ``f``.

    Of the longest stretch that may be fitted, less what the declared effects explain. ``lines`` has frequency [Hz] and
    whether its phase holds; means over ``width`` [s] are fitted.
    """

    f: Floats
    density: Floats
    largest: Floats
    nyquist: float
    width: float
    lines: tuple[tuple[float, bool], ...] = ()


@dataclass(frozen=True)
class Switch:
    """An effect that a reader may take into the model or out of it, at the shape at which it was found or tried.

    ``role`` is "declared", "added", "rival" (of the effect ``of``) or "refused"; ``shape`` has name, value and SI unit.
    ``generic``: a curve without a cause.
    """

    effect: str
    role: str
    of: str = ""
    generic: bool = False
    shape: tuple[tuple[str, float, str], ...] = ()


@dataclass(frozen=True)
class Solved:
    """Which switches are on, the powers of the noise that was fitted with them, and the coefficients of all columns."""

    on: tuple[bool, ...]
    power: tuple[float, ...]
    theta: tuple[float, ...]


@dataclass(frozen=True)
class Switchable:
    """The bins of one target and the columns of every effect that was found or tried: enough to fit any of them anew.

    The bins are those of `Traces`. What is measured is ``Traces.after + columns @ theta``.

    Attributes
    ----------
    switches : tuple of Switch
    columns : ndarray, shape (bins, p)
        Regressors in the unit of the target for one SI unit of the coefficient.
    of : tuple of int
        Index of the switch of each column.
    labels : tuple of (name, SI unit)
    prior, theta : ndarray, shape (p,)
        Standard deviation of the prior, and the coefficient in the final model, zero where it is not in it.
    free : tuple of int
        Bins that no model has to explain.
    blocks : tuple of (run from 1, first bin, end, whether it is fitted, bins from end to end of the run)
    width : float
        Of a bin [s].
    most : tuple of float, optional
        Largest power of each noise term.
    noise : tuple of str
        The noise terms.
    lam, spectra : ndarray, shapes (k,) and (k, terms)
        Variance of a mode of eigenvalue ``lam`` for a unit of each noise term's power.
    rows : ndarray of int, shape (bins, 2)
        First row of each bin and the one after its last, counted through all runs.
    known : tuple of Solved
        The declared model, the final one, that with one switch turned, and with two of which one is a curve without a
        cause: its coefficients are so loosely told that a fit anew, of rounded columns, would err where it goes on.
    own_level : bool
        Whether a run without fitted bins has a level (and a scale factor) of its own.
    cleaned : tuple of str
        What was taken out of the samples before the bins were made, and cannot be switched.
    """

    switches: tuple[Switch, ...]
    columns: Floats
    of: tuple[int, ...]
    labels: tuple[tuple[str, str], ...]
    prior: Floats
    theta: Floats
    free: Sequence[int]
    blocks: tuple[tuple[int, int, int, bool, int], ...]
    width: float
    most: tuple[float, ...] | None
    noise: tuple[str, ...]
    lam: Floats
    spectra: Floats
    rows: NDArray[np.int64]
    known: tuple[Solved, ...]
    own_level: bool
    cleaned: tuple[str, ...] = ()


@dataclass(frozen=True)
class FoundFormula:
    """A product of what was recorded that explains what no effect does, as `insenv.effects.formula` reads it.

    Attributes
    ----------
    formula : str
    parameters : tuple of Estimate
    p_value : float
        With all looks of the search.
    likelihood_ratio : float
        Over the model without it and without curves that have no cause.
    alike : tuple of str
        Formulas that this recording does not tell from it, likeliest first.
    held_out_before, held_out_after : float
    instead_of : tuple of str
        Effects that were added and explain less than it does; the figures are then without them.
    """

    formula: str
    parameters: tuple[Estimate, ...]
    p_value: float
    likelihood_ratio: float
    alike: tuple[str, ...]
    held_out_before: float
    held_out_after: float
    instead_of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Formulas:
    """What a search among formulas came to: how many were ``tried``, the one that was ``found``, and else why none."""

    tried: int
    found: FoundFormula | None = None
    reason: str = ""


@dataclass(frozen=True)
class OfferedModel:
    """A model that was fitted beforehand: which switches are on, and what it leaves of each rest or turn.

    ``rms`` and ``noise_floor`` are of the held-out ones, as in `HeldOut`; ``estimates`` with the index of their switch.
    """

    on: tuple[bool, ...]
    left: Floats
    rms: float
    noise_floor: float
    log_likelihood: float
    estimates: tuple[tuple[int, Estimate], ...]


@dataclass(frozen=True)
class OfferedModels:
    """All models that the switches make, but those that cannot be fitted.

    ``rows``, shape (units, 2): first row of each rest or turn of `Traces` and the one after its last, through all runs.
    """

    switches: tuple[Switch, ...]
    models: tuple[OfferedModel, ...]
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class SwitchableUnit:
    """A whole unit on a table, of which any effect found or tried can be fitted anew, and the cells of one channel.

    With the triangle R of the fitted cells of all six channels, [X, D, y] = Q R, least squares on the rows of R are
    those on the cells. What is measured of the channel is ``Traces.after + columns @ theta``.

    Attributes
    ----------
    switches : tuple of Switch
        ``effect`` is the instrument or "table" and the id: "gyro.scale_factor".
    of : tuple of int
        Index of the switch of each column, -1 of errors of the table that are in every model.
    labels : tuple of (name, SI unit, factor), or None
        Of each column, None where it has no part in this channel.
    triangle : ndarray, shape (p + q + 1, p + q + 1)
    deviations : ndarray, shape (p + q,)
        Deviation that is stated of a coefficient; infinite where none is.
    fitted : int
        Cells of the six channels.
    columns : ndarray, shape (cells, p + q)
        Of the cells of `Traces`.
    theta : ndarray, shape (p + q,)
        In the final model.
    rests : ndarray of int, shape (cells,)
        Number of the rest to which each belongs, from 1.
    """

    switches: tuple[Switch, ...]
    of: tuple[int, ...]
    labels: tuple[tuple[str, str, float] | None, ...]
    triangle: Floats
    deviations: Floats
    fitted: int
    columns: Floats
    theta: Floats
    rests: NDArray[np.int64]


@dataclass(frozen=True)
class TargetFindings:
    """All that was found on one target channel.

    ``cautions`` say, in sentences, which of the figures may be wrong by more than their standard deviations.
    ``beside`` fits an effect that was tried, at the shape nearest to one that is given, beside all that is in the
    model: its coefficients, none where the recording does not tell them.
    ``switchable`` and ``unit_switchable`` give what a reader may fit anew, ``models`` what was fitted for him,
    ``samples`` the spectrum of the samples: they take time, so that a report asks for them and nothing else does.
    """

    target: str
    unit: str
    verdict: str
    reasons: tuple[str, ...]
    declared: tuple[str, ...]
    added: tuple[Added, ...]
    rejected: tuple[Rejected, ...]
    not_testable: tuple[NotTestable, ...]
    held_out: HeldOut
    estimates_before: tuple[Estimate, ...]
    estimates_after: tuple[Estimate, ...]
    noise: tuple[Estimate, ...]
    next_experiment: tuple[NextExperiment, ...]
    spectra: Spectra
    traces: Traces
    derived: tuple[Derived, ...] = ()
    cautions: tuple[str, ...] = ()
    covariance: Covariance | None = None
    formulas: Formulas | None = None
    beside: Callable[[str, Mapping[str, float]], tuple[Estimate, ...]] = field(
        default=unanswered, compare=False, repr=False
    )
    switchable: Callable[[], Switchable | None] = field(default=nothing, compare=False, repr=False)
    unit_switchable: Callable[[], SwitchableUnit | None] = field(default=nothing, compare=False, repr=False)
    models: Callable[[], OfferedModels | None] = field(default=nothing, compare=False, repr=False)
    samples: Callable[[], SampleSpectrum | None] = field(default=nothing, compare=False, repr=False)


@dataclass(frozen=True)
class RejectedRows:
    """Rows ``[start, stop)`` of a run (counted from 0) whose ``target`` is no measurement, and why.

    ``cause`` is one of "outlier", "stuck", "ramp", "motion", "saturation", "burst"; ``size`` how far a burst leaves the
    level, or the value at which a channel clips (SI).
    """

    target: str
    run: int
    start: int
    stop: int
    reason: str
    cause: str = "outlier"
    size: float | None = None


@dataclass(frozen=True)
class CommonMode:
    """Channels whose noise has one cause, electronics or vibration; ``correlation`` is the largest of two of them."""

    channels: tuple[str, ...]
    correlation: float


@dataclass(frozen=True)
class RunRead:
    """A run that the loop was closed on: ``sha256`` is its fingerprint (`insenv.data.fingerprint`)."""

    label: str
    sha256: str
    site: Site
    mounting: Mounting


@dataclass(frozen=True)
class Findings:
    """The whole outcome of one call: one block per target, and what was noticed while reading the data.

    ``procedure`` is "multi-position" where the figures are of rests, ``filing`` the head of a page. ``timed``: whether
    rows have a time, and not their number alone, of which nobody measured the ``duration``.
    """

    title: str
    manifest: str
    rows: int
    duration: float
    verdict: str
    alpha: float
    seed: int
    targets: tuple[TargetFindings, ...]
    remarks: tuple[str, ...]
    source: str = ""
    licence: str = ""
    runs: tuple[RunRead, ...] = ()
    procedure: str = ""
    rows_rejected: tuple[RejectedRows, ...] = ()
    common_mode: tuple[CommonMode, ...] = ()
    filing: Filing = Filing()
    timed: bool = True


#: Verdicts from the strongest to the weakest: with several targets the strongest one speaks for all.
VERDICTS = (
    "effects-found",
    "effects-found-incomplete",
    "confounded",
    "generic-only",
    "unexplained-structure",
    "nothing-significant",
)


def findings_of(
    manifest: Manifest,
    recordings: Sequence[Recording],
    targets: tuple[TargetFindings, ...],
    remarks: tuple[str, ...],
    alpha: float,
    seed: int,
) -> Findings:
    """What was found of each target, with where it is from; the strongest verdict speaks for all."""
    source = manifest.source
    return Findings(
        title=manifest.title,
        manifest=manifest.path.name,
        rows=sum(map(len, recordings)),
        duration=float(sum(len(r) * r.dt for r in recordings)),
        verdict=min((t.verdict for t in targets), key=VERDICTS.index),
        alpha=alpha,
        seed=seed,
        targets=targets,
        remarks=remarks,
        source=" ".join(filter(None, (source.repository, source.commit[:12]))) if source else "",
        licence=source.licence if source else "",
        runs=tuple(RunRead(r.label, fingerprint(r), r.site, r.mounting) for r in recordings),
        timed=manifest.timed,
    )
