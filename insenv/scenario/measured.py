"""The datasheet of a measured recording: ``[datasheet]`` of its manifest, with what stands elsewhere in it.

Site and mounting are those of the run, the noise that of ``[noise]`` where ``[datasheet.noise]`` has none of a channel,
the reference temperature that of ``[model]``. ``[datasheet.declared]`` is written as ``[declared]`` of a scenario:
a mean and a deviation for each parameter, on the channels ``targets``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from insenv.core.errors import InputError, nearest
from insenv.core.estimate import Datasheet, Declared, Limits, Sight
from insenv.core.recording import Recording
from insenv.data.manifest import Manifest
from insenv.data.manifest.schema import DatasheetTable, SightSheetTable, shown
from insenv.data.manifest.spec import ACCELEROMETERS, GYROS
from insenv.effects.base import NoiseEffect
from insenv.effects.catalogue import by_key
from insenv.scenario.values import effect_named, exact, not_negative, parameters, positive
from insenv.sensors.chain import Sensor

_INSTRUMENTS = (*GYROS, *ACCELEROMETERS)


def datasheet_of(manifest: Manifest, run: Recording) -> Datasheet:
    """What an estimator may know of a run before it sees the data.

    Raises
    ------
    InputError
        If an entry is no such quantity, or names a channel or an effect that there is not.
    """
    table, where = manifest.datasheet or DatasheetTable(), f"{manifest.path}: datasheet"
    sampling = positive(table.sampling, "frequency", f"{where}.sampling", 1.0 / run.dt)
    noise = {target: dict(values) for target, values in manifest.noise.items() if values}
    noise |= {target: _noise(target, values, f"{where}.noise") for target, values in table.noise.items()}
    level = (np.inf, np.inf)
    if table.level is not None:
        pitch, roll = (not_negative(text, "angle", f"{where}.level") for text in table.level)
        level = (pitch, roll)
    limits = Limits(
        positive(table.max_rate, "rate", f"{where}.max_rate", np.inf),
        positive(table.max_acceleration, "angular acceleration", f"{where}.max_acceleration", np.inf),
    )
    return Datasheet(
        sampling=sampling,
        duration=positive(table.duration, "time", f"{where}.duration", len(run) / sampling),
        site=run.site,
        mounting=run.mounting,
        limits=limits,
        noise=noise,
        pulse=not_negative(table.pulse, "angle", f"{where}.pulse", 0.0),
        encoder_noise=not_negative(table.encoder_noise, "angle", f"{where}.encoder_noise", 0.0),
        declared=tuple(_declared(manifest, table.declared, f"{where}.declared")),
        sight=None if table.sight is None else _sight(table.sight, f"{where}.sight"),
        level_sd=level,
        reference_temperature=manifest.model.reference_temperature,
    )


def _sight(table: SightSheetTable, where: str) -> Sight:
    return Sight(
        not_negative(table.orientation, "angle", f"{where}.orientation", 0.0),
        not_negative(table.tracking, "angle", f"{where}.tracking", 0.0),
        not_negative(table.installation, "angle", f"{where}.installation", np.inf),
    )


def _noise(target: str, table: Mapping[str, str], where: str) -> dict[str, float]:
    _check_target(target, where)
    found = {}
    for key, text in table.items():
        effect = effect_named(key, f"{where}.{target}.{key}")
        if not isinstance(effect, NoiseEffect):
            raise InputError(f"{where}.{target}.{key} is no noise; wanted it in [datasheet.declared]")
        found[key] = exact(effect.params[0], text, Sensor(target).unit, f"{where}.{target}.{key}")
    return found


def _declared(manifest: Manifest, table: Mapping[str, Any], where: str) -> list[Declared]:
    found = []
    for key, entries in table.items():
        effect, here = effect_named(key, f"{where}.{key}"), f"{where}.{key}"
        for entry in entries if isinstance(entries, list) else [entries]:
            if not isinstance(entry, dict):
                raise InputError(f"{here} = {shown(entry)}; wanted a table of the effect's parameters")
            targets = entry.get("targets", list(manifest.model.targets))
            for target in targets if isinstance(targets, list) else [targets]:
                _check_target(target, f"{here}.targets")
                own = {name: value for name, value in entry.items() if name != "targets"}
                mean, sd = parameters(effect, own, Sensor(target).unit, here)
                found.append(Declared(effect.key, target, mean, sd))
    return found


def _check_target(target: object, where: str) -> None:
    if target not in _INSTRUMENTS:
        raise InputError(f"{where} has {shown(target)}; {nearest(str(target), _INSTRUMENTS)}")


def sheet_table(sheet: Datasheet) -> dict[str, object]:
    """``[datasheet]`` of a manifest that gives ``sheet`` back; what is not known is left out."""
    found: dict[str, object] = {"sampling": _text(sheet.sampling, "Hz")}
    for name, value, unit, silent in (
        ("duration", sheet.duration, "s", np.inf),
        ("pulse", sheet.pulse, "rad", 0.0),
        ("encoder_noise", sheet.encoder_noise, "rad", 0.0),
        ("max_rate", sheet.limits.rate, "rad/s", np.inf),
        ("max_acceleration", sheet.limits.acceleration, "rad/s^2", np.inf),
    ):
        if value != silent and np.isfinite(value):
            found[name] = _text(value, unit)
    if np.isfinite(sheet.level_sd).all():
        found["level"] = [_text(value, "rad") for value in sheet.level_sd]
    if sheet.sight is not None:
        values = {"orientation": sheet.sight.orientation, "tracking": sheet.sight.tracking}
        values["installation"] = sheet.sight.installation
        found["sight"] = {name: _text(value, "rad") for name, value in values.items() if np.isfinite(value)}
    found["noise"] = {
        target: {key: _text(value, by_key(key).params[0].unit_on(Sensor(target).unit)) for key, value in values.items()}
        for target, values in sheet.noise.items()
    }
    found["declared"] = _declared_table(sheet)
    return found


def _declared_table(sheet: Datasheet) -> dict[str, object]:
    """A table for each effect, or several where it is declared of several channels."""
    by_effect: dict[str, list[dict[str, object]]] = {}
    for one in sheet.declared:
        unit = Sensor(one.target).unit
        entry: dict[str, object] = {"targets": one.target}
        for param, mean, sd in zip(by_key(one.effect).params, one.mean, one.sd, strict=True):
            si = param.unit_on(unit)
            entry[param.name] = _text(mean, si) + (f" +- {_text(sd, si)}" if sd else "")
        by_effect.setdefault(one.effect, []).append(entry)
    return {key: entries[0] if len(entries) == 1 else entries for key, entries in by_effect.items()}


def _text(value: float, unit: str) -> str:
    return f"{float(value)!r} {unit}" if unit != "1" else repr(float(value))
