"""What changes whenever the instruments are switched on, and how often slow noise changes.

``[run_to_run]`` names effects that are declared or undeclared, with the standard deviation of what is added to their
parameters at each power-up:

    value = mean + sd z(seed) + run_to_run z(seed, power-up)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from insenv.core.errors import InputError, nearest
from insenv.core.units import quantity_in
from insenv.data.manifest.schema import shown
from insenv.effects.base import OUTPUT, Effect
from insenv.effects.noise import BiasInstability, RateRandomWalk
from insenv.scenario.cast import Planted
from insenv.scenario.schema import InstrumentTable, ScenarioTable
from insenv.scenario.values import LEAST_DISTANCE, effect_named, positive
from insenv.sensors.chain import Sensor


def changing(table: ScenarioTable, planted: Sequence[Planted], path: Path) -> list[Planted]:
    """The planted effects, those that ``[run_to_run]`` names with their deviations.

    Raises
    ------
    InputError
        If it names an effect that is not planted once, or a parameter that it has not, or no deviation.
    """
    found = list(planted)
    for key, entry in table.run_to_run.items():
        where = f"{path}: run_to_run.{key}"
        if not isinstance(entry, dict) or not entry:
            raise InputError(f"{where} = {shown(entry)}; wanted a table of standard deviations")
        named = effect_named(key, where).key
        places = [k for k, p in enumerate(planted) if p.effect.key == named and not p.told]
        if not places:
            known = list(dict.fromkeys(p.effect.key for p in planted if not p.told))
            raise InputError(f"{where} is neither declared nor undeclared; {nearest(key, known)}")
        for k in places:
            found[k] = replace(found[k], again=_deviations(found[k], entry, where))
    return found


def _deviations(p: Planted, entry: dict[str, object], where: str) -> tuple[float, ...]:
    """Standard deviation of each parameter of an effect, zero where none is given."""
    names = [param.name for param in p.effect.params]
    for name in entry:
        if name not in names:
            raise InputError(f"{where}.{name} is no parameter of {p.effect.key}; {nearest(name, names)}")
    deviations = []
    for param, value, sd in zip(p.effect.params, p.values, p.sd, strict=True):
        if param.name not in entry:
            deviations.append(0.0)
            continue
        text, si = entry[param.name], param.unit.replace(OUTPUT, Sensor(p.target).unit)
        deviation = quantity_in(text, si, f"{where}.{param.name}")
        if not deviation >= 0:
            raise InputError(f"{where}.{param.name} = {shown(text)}; wanted a standard deviation of zero or more")
        if value - LEAST_DISTANCE * (deviation**2 + sd**2) ** 0.5 < param.low:
            wanted = f"{param.name} {LEAST_DISTANCE:g} standard deviations or more above {param.low:g} {si}"
            raise InputError(f"{where}.{param.name} = {shown(text)}; wanted {wanted}")
        deviations.append(deviation)
    return tuple(deviations)


def held(instrument: InstrumentTable, path: Path) -> int:
    """Samples for which slow noise stands.

    Raises
    ------
    InputError
        If ``slow_noise`` is no whole part of the sampling rate.
    """
    if instrument.slow_noise is None:
        return 1
    where = f"{path}: instrument.slow_noise"
    ratio = positive(instrument.sampling, "frequency", f"{path}: instrument.sampling") / positive(
        instrument.slow_noise, "frequency", where
    )
    if not (round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-9 * ratio):
        raise InputError(f"{where} = {instrument.slow_noise!r}; wanted the sampling rate or a whole part of it")
    return round(ratio)


def slowed(effect: Effect, hold: int) -> Effect:
    """An effect that stands for so many samples where it is slow."""
    return replace(effect, hold=hold) if isinstance(effect, BiasInstability | RateRandomWalk) else effect
