"""The rate-biased north finder: what it is to every command (`insenv.core.system`)."""

from __future__ import annotations

from pathlib import Path

from insenv.core.system import System, TaskKind, Trial

SYSTEM = System(
    name="NorthFinder",
    kinds=(
        TaskKind(
            "north-finder",
            "rad",
            "north_gls",
            "insenv.systems.north_finder.procedure:NorthFinderProcedure",
            policies=("bidirectional", "constant_rate", "horizon_north", "rate_choice", "greedy_north"),
        ),
        TaskKind(
            "scale-factor-test",
            "1",
            "scale_factor",
            "insenv.systems.rate_table.procedure:ScaleFactorProcedure",
            policies=("scale_factor_test",),
        ),
    ),
    scenario="north_finder/published",
    scenarios=Path(__file__).parent / "scenarios",
    home="north_finder",
    task="insenv.systems.north_finder.env:north_finder",
    environment="insenv.systems.north_finder.env:made",
    vector="insenv.systems.north_finder.env:NorthFinderVectorEnv",
    check="insenv.systems.north_finder.check:check",
    bound="insenv.systems.north_finder.bound:bound",
    scene="insenv.systems.north_finder.scene:SCENE",
    trial=Trial(
        "north_finder/realistic",
        {"duration": "100 s", "task.step": "5 s", "instrument.sampling": "20 Hz", "table.max_rate": "100 deg/s"},
        "correlation",
        [(0.35, 10), (-0.35, 10)],
    ),
)
