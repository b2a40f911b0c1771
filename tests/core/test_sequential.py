"""The sequential count against its exact probabilities, summed over all ways that it can go."""

from __future__ import annotations

from itertools import product

import pytest
from sequential import Shares

SHARES = Shares(good=0.05, bad=0.5, alarm=1e-3, miss=0.04)


def ends(shares: Shares, most: int) -> dict[tuple[bool, ...], bool]:
    """The answer for each sequence of events that is decided within ``most`` trials, cut where it is decided."""
    found: dict[tuple[bool, ...], bool] = {}
    for events in product((False, True), repeat=most):
        seen: list[bool] = []
        try:
            answer = shares.accept(seen.append(event) or event for event in events)  # type: ignore[func-returns-value]
        except AssertionError:
            continue
        found[tuple(seen)] = answer
    return found


def test_it_errs_no_more_than_it_says_and_ends_early() -> None:
    decided = ends(SHARES, 13)

    def probability(share: float, accepted: bool) -> float:
        ways = [events for events, answer in decided.items() if answer is accepted]
        return sum(share ** sum(events) * (1 - share) ** (len(events) - sum(events)) for events in ways)

    assert probability(SHARES.good, accepted=False) < SHARES.alarm
    assert probability(SHARES.bad, accepted=True) < SHARES.miss
    # Of what is good 13 trials decide nine tenths, of what is bad three quarters.
    assert probability(SHARES.good, accepted=True) > 0.9 and probability(SHARES.bad, accepted=False) > 0.75
    assert min(map(len, decided)) < 7


def test_trials_that_decide_nothing_are_no_answer() -> None:
    with pytest.raises(AssertionError, match="decide nothing"):
        SHARES.accept([False, False, True])
