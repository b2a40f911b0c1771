r"""A policy for the two-position calibration that was learnt from the belief: a plug-in that needs no framework.

    PYTHONPATH=scripts insenv evaluate --env TwoPosition --scenario two_position/published_a2 \
        --estimator two_position_joint --policy learnt_policy:LearntPolicy,three_rests

Every five seconds a network of two hidden layers is shown what an agent can know: how well the installation angle is
known, the time that is left, how long the vehicle has rested, how often it has turned, and whether it turns. It says
whether to stay, to turn by 180 degrees, or to stop. The weights are those that `scripts/train_policy.py` has found.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCMIN

#: Where the weights are, unless the environment variable says where else.
WEIGHTS, WHERE = Path(__file__).with_suffix(".json"), "INSENV_LEARNT_POLICY"
#: Time between two decisions [s].
PIECE = 5.0
#: Actions: stay, turn by half a turn, stop; as the environment takes them.
STAY, TURN, STOP = range(3)
ACTIONS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
#: Length of what is shown.
SHOWN = 6


def shown(sd: Floats, left: Floats, rest: Floats, turns: Floats, turning: Floats) -> Floats:
    """What the network sees, shape (..., 6), of a deviation [rad], times [s], a count and a flag."""
    known = np.log(np.maximum(sd, 1e-12) / ARCMIN)
    parts = (
        known,
        left / 300.0 - 1.0,
        np.minimum(rest, 300.0) / 60.0 - 1.0,
        turns - 1.0,
        turning,
        np.exp(-rest / 20.0),
    )
    return np.stack([np.asarray(part, float) for part in parts], axis=-1)


def logits(layers: list[tuple[Floats, Floats]], seen: Floats) -> Floats:
    """Of the actions, shape (..., 3); row by row, so that a batch is the single run."""
    for k, (weight, bias) in enumerate(layers):
        seen = (seen[..., None, :] * weight).sum(axis=-1) + bias
        seen = np.tanh(seen) if k < len(layers) - 1 else seen
    return seen


def loaded(path: Path) -> list[tuple[Floats, Floats]]:
    """Weights and biases of the layers.

    Raises
    ------
    InputError
        If there is no such file, or it holds no network from what is shown to the actions.
    """
    try:
        layers = [
            (np.array(one["weight"], float), np.array(one["bias"], float)) for one in json.loads(path.read_text())
        ]
        sizes = [SHOWN, *(len(bias) for _, bias in layers)]
        wanted = list(zip(sizes[1:], sizes[:-1], strict=True))
        fits = sizes[-1] == len(ACTIONS) and [weight.shape for weight, _ in layers] == wanted
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: no weights ({error}); wanted what scripts/train_policy.py writes") from None
    if not fits:
        raise InputError(f"{path}: layers of sizes {sizes}; wanted {SHOWN} numbers in and {len(ACTIONS)} out")
    return layers


@dataclass(frozen=True)
class Seen:
    """Rest so far [s], turns so far and whether the vehicle turns, each (...)."""

    rest: Floats
    turns: Floats
    turning: Floats


class LearntPolicy:
    """The action of the largest logit.

    Parameters
    ----------
    datasheet : Datasheet
    layers : list of (weight, bias), optional
        Of the network; default: those of the file.
    """

    def __init__(self, datasheet: Datasheet, layers: list[tuple[Floats, Floats]] | None = None) -> None:
        self.datasheet = datasheet
        self.layers = loaded(Path(os.environ.get(WHERE, WEIGHTS))) if layers is None else layers

    def reset(self, batch: int | None = None) -> Seen:
        """At rest."""
        return begun(() if batch is None else (batch,))

    def act(self, state: Seen, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Seen]:
        """Turn and stop of every run, shape (..., 2); it must be told an estimate of "installation_angle"."""
        if estimate is None:
            raise InputError("learnt_policy: no estimate given; wanted one of installation_angle to look at")
        dt, t = self.datasheet.dt, 0.0
        if chunk is not None and len(chunk):
            t = float(chunk.t[-1])
            turning = np.broadcast_to(chunk.values("turning", "1"), (*state.rest.shape, len(chunk))).any(axis=-1)
            state = gone_on(state, turning, len(chunk) * dt)
        sd = np.asarray(estimate.of("installation_angle")[1])
        left = np.broadcast_to(max(self.datasheet.duration - t, 0.0), sd.shape)
        chosen = logits(self.layers, shown(sd, left, state.rest, state.turns, state.turning)).argmax(axis=-1)
        due = (t + 0.5 * dt) % PIECE < dt and t > 0
        chosen = np.where(state.turning.astype(bool) | (not due), STAY, chosen)
        return ACTIONS[chosen].copy(), asked(state, chosen)


def begun(shape: tuple[int, ...]) -> Seen:
    """At rest, nothing done."""
    return Seen(np.zeros(shape), np.zeros(shape), np.zeros(shape))


def gone_on(state: Seen, turning: Any, seconds: float) -> Seen:
    """After so many seconds, in a part of which the vehicle turned."""
    flag = np.asarray(turning, float)
    return Seen(np.where(flag > 0, 0.0, state.rest + seconds), state.turns, flag)


def asked(state: Seen, chosen: Any) -> Seen:
    """With a turn that was begun."""
    turn = np.asarray(chosen) == TURN
    return Seen(np.where(turn, 0.0, state.rest), state.turns + turn, np.where(turn, 1.0, state.turning))


def saved(layers: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the weights, whole or not at all."""
    temporary = path.with_suffix(".part")
    rounded = [{k: np.round(np.asarray(v, float), 5).tolist() for k, v in layer.items()} for layer in layers]
    temporary.write_text(json.dumps(rounded) + "\n", encoding="utf-8")
    os.replace(temporary, path)
