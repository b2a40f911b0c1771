"""A scenario's tables -> the rig that plays it, and what its manifest will say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError, nearest
from insenv.core.recording import Floats
from insenv.core.series.allan import QUANTIZATION, WHITE
from insenv.data.manifest.checks import VELOCITY_RANDOM_WALK
from insenv.data.manifest.schema import shown
from insenv.effects.base import DrivenEffect, Effect, NoiseEffect
from insenv.effects.catalogue import ALL, by_key
from insenv.plants.base import Plant, Scene
from insenv.rig import Fitted, Rig
from insenv.scenario import cast
from insenv.scenario import plant as plants
from insenv.scenario.cast import Planted, Truth
from insenv.scenario.draws import PHASE, Fixed, Spread, generator, listed
from insenv.scenario.run_to_run import changing, held, slowed
from insenv.scenario.schema import ScenarioTable, family, family_name
from insenv.scenario.spec import TaskSpec, task_spec
from insenv.scenario.values import effect_named, exact, parameters, positive
from insenv.sensors.chain import Sensor

#: Longest recording that is written: more is a slip of the pen.
MOST_SAMPLES = 1_000_000_000
#: Names of the noise terms that a maker may declare.
NOISES = tuple(effect.id for effect in ALL if isinstance(effect, NoiseEffect))


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
        With every uncertain value at its mean, and a random azimuth at zero; of a run: `cast`.
    samples : int
    targets : tuple of str
        Channels that the manifest wants explained.
    planted : tuple of Planted
        All that is simulated, means and deviations.
    task : TaskSpec, optional
        What an environment asks for.
    spread : Spread
        What differs from run to run of the plant.
    """

    path: Path
    table: ScenarioTable
    rig: Rig
    samples: int
    targets: tuple[str, ...]
    planted: tuple[Planted, ...]
    task: TaskSpec | None = None
    spread: Spread = field(default_factory=Fixed)

    @property
    def duration(self) -> float:
        """Time that is simulated [s]."""
        return self.samples / self.rig.rate

    def truth(self, seed: int, power_up: int = 1) -> Truth:
        """What run ``seed`` has, its random values drawn, since it was switched on for the ``power_up``-th time.

        Raises
        ------
        InputError
            If the seed is negative, or the power-up below 1.
        """
        if power_up < 1:
            raise InputError(f"power-up {power_up} given; wanted 1 or more")
        return cast.truth(self.rig.plant, self.spread, self.planted, seed, power_up)

    def cast(self, seeds: int | Sequence[int], power_ups: int | Sequence[int] = 1) -> Rig:
        """The rig of one run, or of a batch of R.

        Parameters
        ----------
        seeds : int or sequence of int
            A sequence gives a batch: parameters of shape (R, p), on a turntable an azimuth of shape (R,), on a
            vehicle what is drawn for it. Its rows are the runs alone, bit for bit.
        power_ups : int or sequence of int
            How often the instruments were switched on: each time has values of its own for ``[run_to_run]``.

        Raises
        ------
        InputError
            If a seed is negative, or there is none.
        """
        runs = listed(seeds)
        numbers = len(runs) * [power_ups] if isinstance(power_ups, int) else power_ups
        rigs = [self._rig(self.truth(seed, int(p))) for seed, p in zip(runs, numbers, strict=True)]
        return rigs[0] if isinstance(seeds, int | np.integer) else cast.batch(rigs, self.spread)

    def phases(self, seeds: int | Sequence[int], target: str) -> float | Floats:
        """Part of a pulse that the counter of ``target`` holds at the start, from 0 to below 1.

        A float, or of shape (R,) for a batch.

        Raises
        ------
        InputError
            If a seed is negative, or there is none.
        """
        place = PHASE + [fitted.sensor.target for fitted in self.rig.instruments].index(target)
        found = [float(generator(seed, place).random()) for seed in listed(seeds)]
        return found[0] if isinstance(seeds, int | np.integer) else np.array(found)

    def _rig(self, truth: Truth) -> Rig:
        outputs = (fitted.sensor.target for fitted in self.rig.instruments)
        return Rig(truth.plant, tuple(_instrument(output, truth.planted) for output in outputs), self.rig.rate)

    @property
    def declared(self) -> tuple[str, ...]:
        """Keys of the effects that the manifest declares.

        Those with a shape (a time constant) or driven by chance are not among them: no fit of a declared model
        has them, and closing the loop may find what they leave.
        """
        return self.declared_of(tuple(fitted.sensor.target for fitted in self.rig.instruments))

    def declared_of(self, targets: tuple[str, ...]) -> tuple[str, ...]:
        """The same, of those channels alone."""
        known = (p for p in self.planted if p.origin == "declared" and p.target in targets)
        return tuple(dict.fromkeys(p.effect.key for p in known if _fitted(p.effect)))


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
    planted = (*_noise(table, outputs, path), *changing(table, _effects(table, plant, targets, path), path))
    _complete(plant, planted, path)
    if any("force" in p.effect.needs for p in planted):
        plant = plant.felt_force()
    rig = Rig(plant, tuple(_instrument(output, planted) for output in outputs), rate)
    _exposed(rig, planted, path)
    return Scenario(
        path,
        table,
        rig,
        samples,
        targets.explained,
        planted,
        task_spec(table, samples, path),
        plants.spread(table, path),
    )


def _complete(plant: Plant, planted: tuple[Planted, ...], path: Path) -> None:
    """Refuse a scenario that leaves out what the plant does to the instruments."""
    there = {p.effect.id for p in planted}
    for effect_id, cause in plant.entails.items():
        if effect_id not in there:
            raise InputError(f"{path}: {cause}; wanted {effect_id} = {{}} in [declared] or in [undeclared]")
    for effect_id, cause in plant.excludes.items():
        if effect_id in there:
            raise InputError(f"{path}: {cause}; wanted it left out")


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
    planted, hold = [], held(table.instrument, path)
    for output in outputs:
        instrument, kind = family(table, output), family_name(output)
        for name, text in instrument.noise.items():
            where = f"{path}: instrument.{kind}.noise.{name}"
            key = WHITE if name == VELOCITY_RANDOM_WALK and kind == "accel" else name
            if key not in NOISES:
                raise InputError(f"{where} is no noise that is known; {nearest(name, NOISES)}")
            effect = slowed(by_key(key), hold)
            value = exact(effect.params[0], text, Sensor(output).unit, where)
            if not (instrument.pulses and key == QUANTIZATION):  # whole pulses are the quantization
                planted.append(Planted(output, effect, (value,), (0.0,), "noise"))
    return planted


def _effects(table: ScenarioTable, plant: Plant, targets: Targets, path: Path) -> list[Planted]:
    """What the declared and the undeclared tables name."""
    planted = []
    for origin in ("declared", "undeclared"):
        for key, entries in getattr(table, origin).items():
            where = f"{path}: {origin}.{key}"
            effect = effect_named(key, where)
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


def _entry(effect: Effect, entry: object, plant: Plant, targets: Targets, place: tuple[str, str]) -> list[Planted]:
    """One table of an effect, on each of its targets; ``place`` is its origin and where it stands."""
    origin, where = place
    if not isinstance(entry, dict):
        raise InputError(f"{where} = {shown(entry)}; wanted a table of the effect's parameters")
    rest: dict[str, Any] = dict(entry)
    rest.pop("targets", None)
    planted = []
    for target in _named(effect, entry.get("targets"), targets, where):
        if not rest and (told := plants.known_parameters(plant, effect)) is not None:
            planted.append(Planted(target, effect, told, (0.0,) * len(told), origin, told=True))
        else:
            planted.append(Planted(target, effect, *parameters(effect, rest, Sensor(target).unit, where), origin))
    return planted


def _fitted(effect: Effect) -> bool:
    """Whether a declared model may hold an effect: it is linear but for what is given."""
    return not isinstance(effect, DrivenEffect) and not effect.shapes


def _named(effect: Effect, named: object, targets: Targets, where: str) -> list[str]:
    """Channels that have an effect: as named, else those explained that can have it."""
    if named is None:
        able = [target for target in targets.explained if _able(effect, target)]
        if not able:
            raise InputError(f"{where} is an effect of {effect.instruments[0]}s; wanted targets that can have it")
        return able
    if named == []:
        raise InputError(f"{where}.targets = []; wanted at least one channel")
    found: list[Any] = named if isinstance(named, list) else [named]
    for target in found:
        if target not in targets.simulated:
            raise InputError(f"{where}.targets has {shown(target)}; {nearest(str(target), targets.simulated)}")
        if not _able(effect, target):
            raise InputError(f"{where}.targets has {target!r}; {effect.key} is an effect of {effect.instruments[0]}s")
    return found


def _able(effect: Effect, target: str) -> bool:
    """Whether a channel's instrument can have an effect."""
    return ("accelerometer" if family_name(target) == "accel" else "gyro") in effect.instruments


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
