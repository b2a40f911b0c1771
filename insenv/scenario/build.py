"""A scenario's tables -> the rig that plays it, and what its manifest will say."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.manifest.checks import VELOCITY_RANDOM_WALK
from insenv.core.manifest.schema import nearest, shown
from insenv.effects.base import Effect, NoiseEffect
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.plants.base import Plant, Scene
from insenv.rig import Fitted, Rig
from insenv.scenario import plant as plants
from insenv.scenario.schema import ScenarioTable, family, family_name
from insenv.scenario.values import parameters, positive
from insenv.sensors.chain import Sensor

#: Longest recording that is written: more is a slip of the pen.
MOST_SAMPLES = 1_000_000_000
#: Names of the noise terms that a maker may declare.
NOISES = tuple(effect.id for effect in CATALOGUE if isinstance(effect, NoiseEffect))


@dataclass(frozen=True)
class Planted:
    """One effect that a scenario simulates: on which channel, with which SI values, and where it was named.

    ``origin`` is "noise" (the maker's figures), "declared" or "undeclared".
    """

    target: str
    effect: Effect
    values: tuple[float, ...]
    origin: str


@dataclass(frozen=True)
class Targets:
    """Channels that are ``simulated``, and those of them that the manifest wants ``explained``."""

    simulated: tuple[str, ...]
    explained: tuple[str, ...]


@dataclass(frozen=True)
class Scenario:
    """A scenario, checked.

    Attributes
    ----------
    path : Path
    table : ScenarioTable
        As written.
    rig : Rig
    samples : int
    targets : tuple of str
        Channels that the manifest wants explained.
    planted : tuple of Planted
        All that is simulated.
    """

    path: Path
    table: ScenarioTable
    rig: Rig
    samples: int
    targets: tuple[str, ...]
    planted: tuple[Planted, ...]

    @property
    def declared(self) -> tuple[str, ...]:
        """Keys of the effects that the manifest declares."""
        return tuple(dict.fromkeys(p.effect.key for p in self.planted if p.origin == "declared"))


def build(table: ScenarioTable, path: Path) -> Scenario:
    """Rig and expectations of a scenario.

    Raises
    ------
    InputError
        If a quantity is wrong, an effect unknown, or the plant cannot do or show what is asked for.
    """
    rate = positive(table.instrument.sampling, "frequency", f"{path}: instrument.sampling")
    plant, duration = plants.build(table, path)
    if not 2 <= duration * rate <= MOST_SAMPLES:
        wanted = f"from 2 to {MOST_SAMPLES:.0e}"
        raise InputError(f"{path}: {duration:g} s at {rate:g} Hz are {duration * rate:g} samples; wanted {wanted}")
    samples = round(duration * rate)
    outputs = tuple(_first_scene(plant, rate).motions)
    targets = Targets(outputs, _targets(table, outputs, path))
    planted = (*_noise(table, outputs, path), *_effects(table, plant, targets, path))
    _complete(plant, planted, path)
    rig = Rig(plant, tuple(_instrument(output, planted) for output in outputs), rate)
    _exposed(rig, planted, path)
    return Scenario(path, table, rig, samples, targets.explained, planted)


def _complete(plant: Plant, planted: tuple[Planted, ...], path: Path) -> None:
    """Refuse a scenario that leaves out what the plant does to the instruments."""
    for effect_id, cause in plants.entailed(plant):
        if effect_id not in {p.effect.id for p in planted}:
            raise InputError(f"{path}: {cause}; wanted {effect_id} = {{}} in [declared] or in [undeclared]")


def _targets(table: ScenarioTable, outputs: tuple[str, ...], path: Path) -> tuple[str, ...]:
    """Channels to explain: as named, else all."""
    named = table.model.target
    targets = outputs if named is None else (named,) if isinstance(named, str) else tuple(named)
    for target in targets:
        if target not in outputs:
            raise InputError(f"{path}: model.target = {target!r} is not simulated; {nearest(target, outputs)}")
    if not targets or len(set(targets)) < len(targets):
        raise InputError(f"{path}: model.target = {shown(named)}; wanted each channel once, and at least one")
    return targets


def _noise(table: ScenarioTable, outputs: tuple[str, ...], path: Path) -> list[Planted]:
    """The noise that the maker declares, of every instrument."""
    planted = []
    for output in outputs:
        instrument, kind = family(table, output), family_name(output)
        for name, text in instrument.noise.items():
            where = f"{path}: instrument.{kind}.noise.{name}"
            key = "angle_random_walk" if name == VELOCITY_RANDOM_WALK and kind == "accel" else name
            if key not in NOISES:
                raise InputError(f"{where} is no noise that is known; {nearest(name, NOISES)}")
            effect = by_key(key)
            (value,) = parameters(effect, {effect.params[0].name: text}, Sensor(output).unit, where)
            if not (instrument.pulses and key == "quantization"):  # whole pulses are the quantization
                planted.append(Planted(output, effect, (value,), "noise"))
    return planted


def _effects(table: ScenarioTable, plant: Plant, targets: Targets, path: Path) -> list[Planted]:
    """What the declared and the undeclared tables name."""
    planted = []
    for origin in ("declared", "undeclared"):
        for key, entries in getattr(table, origin).items():
            where = f"{path}: {origin}.{key}"
            effect = _effect(key, where)
            if origin == "declared" and isinstance(effect, NoiseEffect):
                raise InputError(f"{where} is noise; what the maker declares of it belongs to [instrument.gyro.noise]")
            if entries == []:
                raise InputError(f"{where} = []; wanted at least one table of parameters")
            for entry in entries if isinstance(entries, list) else [entries]:
                planted += _entry(effect, entry, plant, targets, (origin, where))
    twice = [key for key in table.declared if key in table.undeclared]
    if twice:
        raise InputError(f"{path}: {twice[0]!r} is declared and undeclared; wanted one of the two")
    return planted


def _effect(key: str, where: str) -> Effect:
    """The catalogue's effect of that name."""
    try:
        return by_key(key)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _entry(effect: Effect, entry: object, plant: Plant, targets: Targets, place: tuple[str, str]) -> list[Planted]:
    """One table of an effect, on each of its targets; ``place`` is its origin and where it stands."""
    origin, where = place
    if not isinstance(entry, dict):
        raise InputError(f"{where} = {shown(entry)}; wanted a table of the effect's parameters")
    rest: dict[str, Any] = dict(entry)
    named = rest.pop("targets", list(targets.explained))
    planted = []
    if named == []:
        raise InputError(f"{where}.targets = []; wanted at least one channel")
    for target in named if isinstance(named, list) else [named]:
        if target not in targets.simulated:
            raise InputError(f"{where}.targets has {shown(target)}; {nearest(str(target), targets.simulated)}")
        values = None if rest else plants.told_by(plant, effect)
        values = parameters(effect, rest, Sensor(target).unit, where) if values is None else values
        planted.append(Planted(target, effect, values, origin))
    return planted


def _instrument(output: str, planted: tuple[Planted, ...]) -> Fitted:
    """The instrument of one channel, with all that was planted on it."""
    own = [p for p in planted if p.target == output]
    sensor = Sensor(output, tuple(p.effect for p in own))
    return Fitted(sensor, sensor.theta([p.values for p in own]))


def _exposed(rig: Rig, planted: tuple[Planted, ...], path: Path) -> None:
    """Refuse what the plant gives no exposure for: it would have to be left out in silence."""
    scene = _first_scene(rig.plant, rig.rate)
    for p in planted:
        if missing := p.effect.missing(scene.motions[p.target]):
            raise InputError(
                f"{path}: {p.origin}.{p.effect.key} on {p.target} needs {', '.join(missing)}, which this plant lacks"
            )


def _first_scene(plant: Plant, rate: float) -> Scene:
    return plant.advance(plant.begin(), None, np.array([0.0, 1.0 / rate]), np.zeros((plant.draws, 1)))[0]
