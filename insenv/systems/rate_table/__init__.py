"""Scale factor and bias on a rate table: what it is to every command (`insenv.core.system`)."""

from __future__ import annotations

from pathlib import Path

from insenv.core.system import System, TaskKind, Trial

SYSTEM = System(
    name="RateTable",
    kinds=(
        TaskKind(
            "rate-table",
            "1",
            "rate_line",
            "insenv.systems.rate_table.procedure:RateTableProcedure",
            ranged=True,
            policies=(
                "optimal_ladder",
                "published_ladder",
                "van_der_corput",
                "sweep_and_refine",
                "greedy_information",
                "greedy_rate_table",
                "horizon_rate_table",
            ),
        ),
    ),
    scenario="rate_table/b215",
    scenarios=Path(__file__).parent / "scenarios",
    home="rate_table",
    task="insenv.systems.rate_table.env:rate_table",
    environment="insenv.systems.rate_table.env:made",
    vector="insenv.systems.rate_table.env:RateTableVectorEnv",
    check="insenv.systems.rate_table.check:check",
    bound="insenv.systems.rate_table.bound:bound",
    scene="insenv.systems.rate_table.scene:SCENE",
    trial=Trial(
        "rate_table/kvh13",
        {"duration": "150 s", "task.step": "2 s", "instrument.sampling": "20 Hz"},
        "rate_line",
        [(0.0, 10), (0.4, 10), (-0.4, 10), (0.2, 10), (-0.2, 10), (0.8, 10), (-0.8, 10), (0.0, 5)],
    ),
)
