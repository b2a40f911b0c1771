"""Findings made up for the tests of the reports: plausible recordings whose figures the eye can check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.findings import (
    Added,
    Derived,
    Estimate,
    Findings,
    HeldOut,
    NextExperiment,
    NotTestable,
    Rejected,
    Spectra,
    TargetFindings,
    Traces,
)
from insenv.report import to_html

DEG_H = np.pi / 180 / 3600


def one_target(points: int = 2400, title: str = "Laser gyro on a tilted table") -> Findings:
    """A gyro on a rate table whose encoder repeats an error: two effects found, all covariates present."""
    return findings((gyro(points),), title=title)


def several_targets() -> Findings:
    """Two accelerometers with base tilt, and one gyro on which nothing was found."""
    return findings(
        (accelerometer("accel_x", 9.79), accelerometer("accel_y", 9.81), plain_gyro("gyro_z")),
        title="Ring laser triad on a slowly tilting base",
    )


def nothing_significant() -> Findings:
    """A gyro at rest without any covariate, on which nothing was found."""
    return findings((plain_gyro("gyro"),), title="Gyro at rest")


def confounded() -> Findings:
    """One rate only: the encoder's first harmonic and a rate locked to the angle look alike."""
    target = gyro(900)
    rivals = ("angle_locked_rate:1", "g_sensitivity")
    added = replace(target.added[0], confounded_with=rivals, remark="equal likelihood to 0.1")
    return findings((replace(target, verdict="confounded", added=(added,)),), title="One rate only")


def hidden_in_the_earth_rate() -> Findings:
    """A gyro on which only the magnitude of the Earth rate tells that something is wrong, and its azimuth."""
    target = gyro(300)
    rms = target.held_out.before
    added = replace(target.added[0], confounded_with=("angle_locked_rate:1",), held_out_before=rms, held_out_after=rms)
    azimuth = (Estimate("earth_rate", "azimuth", value, sd, "rad") for value, sd in ((0.7, 1e-4), (0.71, 0.15)))
    separates = ("encoder_harmonic:1", "angle_locked_rate:1")
    profile = {"kind": "reversal", "rate": "10 deg/s", "dwell": "144 s"}
    target = replace(
        target,
        verdict="confounded",
        added=(added,),
        held_out=replace(target.held_out, after=rms),
        next_experiment=(
            NextExperiment(separates, "turn the table both ways", 108.0, profile),
            NextExperiment(("earth_rate", "angle_locked_rate:1"), "turn the base by 180 degrees", None),
        ),
        derived=(Derived("azimuth", "rad", *azimuth),),
        cautions=("The azimuth may be off.",),
    )
    return findings((target,), title="Earth rate too large")


def empty_covariates() -> Findings:
    """As `one_target`, with nothing to draw against but time."""
    target = gyro(600)
    return findings((replace(target, traces=replace(target.traces, covariates={})),))


def not_finite() -> Findings:
    """Figures that could not be computed."""
    target = plain_gyro("gyro")
    nan = float("nan")
    held = replace(target.held_out, after=nan, noise_floor=float("inf"))
    added = replace(gyro(600).added[0], p_value=nan, held_out_after=nan)
    return findings((replace(target, held_out=held, added=(added,), verdict="effects-found-incomplete"),))


def findings(targets: tuple[TargetFindings, ...], title: str = "Made up") -> Findings:
    """A whole outcome around ``targets``."""
    return Findings(
        title=title,
        manifest="run.toml",
        rows=120_000,
        duration=1200.0,
        verdict=targets[0].verdict,
        alpha=0.01,
        seed=0,
        targets=targets,
        remarks=("2 gaps in time, the longest 0.31 s at row 40211", "temperature changes by 14.2 K"),
        source="Made up for a test, https://example.org/data",
        licence="CC0-1.0",
    )


def gyro(points: int) -> TargetFindings:
    """A gyro on a rate table, two runs; encoder harmonic and thermal lag found."""
    rng = np.random.default_rng(1)
    t = np.linspace(0, 1200, points)
    rate = np.deg2rad(10.0) * np.sign(np.sin(2 * np.pi * t / 400) + 1e-9)
    angle = np.mod(np.deg2rad(10.0) * t, 2 * np.pi)
    temperature = 298.15 + 14 * (1 - np.exp(-t / 500))
    noise = 0.02 * DEG_H * rng.standard_normal(points)
    lost = (0.11 * np.cos(angle) + 0.003 * (temperature - 298.15) * np.exp(-t / 400)) * DEG_H
    traces = traces_of(t, noise + lost, noise, {"temperature": temperature, "rate": rate, "angle": angle})
    return TargetFindings(
        target="gyro",
        unit="rad/s",
        verdict="effects-found",
        reasons=("no spline explains what is left (best p = 0.3)",),
        declared=("bias", "scale_factor", "earth_rate"),
        added=(
            Added(
                "encoder_harmonic", 1,
                (
                    Estimate("encoder_harmonic", "c", 1.2e-6, 3e-9, "rad"),
                    Estimate("encoder_harmonic", "s", 0.0, 3e-9, "rad"),
                ),
                1e-9, 812.0, (), 4.1e-7, 1.3e-7,
            ),
            Added(
                "bias_thermal_lag", None,
                (
                    Estimate("bias_thermal_lag", "c", 2.1e-8, 4e-10, "rad/s/K"),
                    Estimate("bias_thermal_lag", "tau", 412.0, 31.0, "s"),
                ),
                3e-20, 96.0, (), 1.3e-7, 1.01e-7,
            ),
        ),
        rejected=rejected(),
        not_testable=not_testable(),
        held_out=HeldOut(4.1e-7, 1.01e-7, 0.98e-7, "rad/s", 1.0),
        estimates_before=(
            Estimate("bias", "c", 5.2e-8, 2.0e-9, "rad/s"),
            Estimate("scale_factor", "c", -1.32e-5, 2.1e-7, ""),
            Estimate("earth_rate", "c", 3.1e-6, 4e-9, "rad/s"),
        ),
        estimates_after=(
            Estimate("bias", "c", 3.91e-8, 9.1e-10, "rad/s"),
            Estimate("scale_factor", "c", -1.311e-5, 9e-8, ""),
            Estimate("earth_rate", "c", 3.104e-6, 2e-9, "rad/s"),
        ),
        noise=(
            Estimate("angle_random_walk", "N", 8.7e-8, 1e-9, "rad/sqrt(s)"),
            Estimate("bias_instability", "B", 2.4e-8, 3e-9, "rad/s"),
        ),
        next_experiment=(
            NextExperiment(
                ("encoder_harmonic:1", "angle_locked_rate:1"),
                "reverse the table: 300 s at +10 deg/s, 300 s at -10 deg/s", 9.1,
            ),
        ),
        spectra=spectra_of(noise + lost, noise, t[1] - t[0], declared=True),
        traces=traces,
    )  # fmt: skip


def accelerometer(name: str, gravity: float) -> TargetFindings:
    """A level accelerometer on a base that tilts."""
    rng = np.random.default_rng(len(name) + int(100 * gravity))
    t = np.linspace(0, 3000, 9000)
    noise = 9e-4 * rng.standard_normal(len(t))
    lost = 0.02 * np.sin(2 * np.pi * t / 1700) + 0.006 * np.sin(2 * np.pi * t / 260)
    return TargetFindings(
        target=name,
        unit="m/s^2",
        verdict="effects-found",
        reasons=(),
        declared=("bias",),
        added=(
            Added(
                "base_tilt", None, (Estimate("base_tilt", "c", gravity, 0.02, "m/s^2"),), 1e-80, 51234.0, (),
                1.54e-2, 9.8e-4, remark="one physical cause, added to accel_x and accel_y together",
            ),
        ),
        rejected=rejected(),
        not_testable=not_testable(),
        held_out=HeldOut(1.54e-2, 9.8e-4, 9.1e-4, "m/s^2", 5.0),
        estimates_before=(Estimate("bias", "c", 2.31e-2, 9e-4, "m/s^2"),),
        estimates_after=(Estimate("bias", "c", 1.412e-2, 2.2e-5, "m/s^2"),),
        noise=(Estimate("angle_random_walk", "N", 5.1e-4, 6e-6, "m/s^2*sqrt(s)"),),
        next_experiment=(),
        spectra=spectra_of(noise + lost, noise, t[1] - t[0], declared=False),
        traces=traces_of(t, noise + lost, noise, {}),
    )  # fmt: skip


def plain_gyro(name: str) -> TargetFindings:
    """A gyro at rest with nothing but noise."""
    target = gyro(1200)
    traces = replace(target.traces, before=target.traces.after, covariates={})
    spectra = replace(target.spectra, psd_before=target.spectra.psd_after, allan_before=target.spectra.allan_after)
    return replace(
        target,
        target=name,
        verdict="nothing-significant",
        reasons=(),
        added=(),
        estimates_after=target.estimates_before,
        held_out=HeldOut(1.0e-7, 1.0e-7, 0.98e-7, "rad/s", 1.0),
        next_experiment=(),
        traces=traces,
        spectra=spectra,
    )


def rejected() -> tuple[Rejected, ...]:
    """Candidates that were refused, for the two reasons."""
    dull = [
        Rejected(effect, p, 3.0 * (1 - p), "not significant")
        for effect, p in (("bias_step", 0.4), ("bias_drift", 0.71), ("tone", 0.9), ("timing_skew", 0.055),
                          ("scale_factor_asymmetry", 0.3), ("scale_factor_cubic", 1.0))
    ]  # fmt: skip
    return (Rejected("bias_temperature_rate", 2e-5, 31.4, "held-out worse"), *dull)


def not_testable() -> tuple[NotTestable, ...]:
    """Effects for which channels or conditions are missing."""
    return (
        NotTestable("g_sensitivity", ("accel_x",)),
        NotTestable("cross_axis", ("gyro_y", "gyro_z")),
        NotTestable("lock_in", (), "the rate never comes near zero"),
    )


def traces_of(t: Floats, before: Floats, after: Floats, covariates: Mapping[str, Floats]) -> Traces:
    """Two runs, the last 40 % of each held out."""
    half = len(t) // 2
    run = np.where(np.arange(len(t)) < half, 1, 2)
    own = np.where(run == 1, t, t - t[half])
    return Traces(own, run, own > 0.6 * t[half], before, after, covariates)


def spectra_of(before: Floats, after: Floats, dt: float, declared: bool) -> Spectra:
    """Periodograms (two-sided) and plain Allan deviations, with white noise as the model."""
    n = len(after)
    f = np.asarray(np.fft.rfftfreq(n, dt)[1:], np.float64)
    psd_before, psd_after = (dt / n * np.abs(np.fft.rfft(x)[1:]) ** 2 for x in (before, after))
    m = np.unique(np.geomspace(1, n // 5, 25).astype(int))
    tau = m * dt
    adev = [np.array([_allan(x, k) for k in m]) for x in (before, after)]
    white = float(np.std(after) * np.sqrt(dt))
    spread = np.sqrt(tau / (n * dt))
    return Spectra(
        f=f,
        psd_before=psd_before,
        psd_after=psd_after,
        psd_fitted=np.full_like(f, white**2),
        psd_declared=np.full_like(f, (0.8 * white) ** 2) if declared else None,
        tau=tau,
        allan_before=adev[0],
        allan_after=adev[1],
        allan_lower=adev[1] * (1 - 0.8 * spread),
        allan_upper=adev[1] * (1 + spread),
        allan_fitted=white / np.sqrt(tau),
        allan_declared=0.8 * white / np.sqrt(tau) if declared else None,
    )


def _allan(x: Floats, m: int) -> float:
    means = x[: len(x) // m * m].reshape(-1, m).mean(axis=1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)))


EVERY = {
    "one": one_target,
    "several": several_targets,
    "nothing": nothing_significant,
    "confounded": confounded,
    "hidden in the Earth rate": hidden_in_the_earth_rate,
    "no covariates": empty_covariates,
    "not finite": not_finite,
}


@cache
def shown(make: Callable[[], Findings]) -> tuple[Findings, str]:
    """What one of these makes and its page, drawn once for all tests."""
    made = make()
    return made, to_html(made)
