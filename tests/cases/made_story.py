"""A story of settling in the environment, made without playing it."""

from __future__ import annotations

from dataclasses import replace

from made_findings import empty_covariates

from insenv.core.units import ARCSEC
from insenv.identify.story import Chapter, FirstRun, Story, Wanted

NORTH = "north_finder/undeclared"
NORTH_WANTED = Wanted("azimuth", "rad", 30 * ARCSEC, "north_gls")


def made(wanted: Wanted | None = NORTH_WANTED) -> Story:
    found = empty_covariates()

    def chapter(verdict: str, error: float, elapsed: float) -> Chapter:
        answer = FirstRun(error * ARCSEC, 31 * ARCSEC) if wanted else None
        keys = ("encoder_harmonic:1", "angle_locked_rate:1") if elapsed > 300 else ()
        steps = {"kind": "steps", "steps": [["10 s", "1 deg/s"]]}
        return Chapter(
            "turn <it>", keys, 12.0, steps, {"duration": "300 s"}, 300.0, elapsed, replace(found, verdict=verdict),
            answer, None,
        )  # fmt: skip

    chapters = (chapter("confounded", 2522, 300.0), chapter("effects-found", -30, 600.0))
    raw = FirstRun(2522 * ARCSEC, 31 * ARCSEC) if wanted else None
    return Story(NORTH, "A <made> story", 11, 3000.0, wanted, raw, chapters, "settled")
