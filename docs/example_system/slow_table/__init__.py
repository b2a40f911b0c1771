"""North on a table that turns slowly: what it is to every command (`insenv.core.system`)."""

from pathlib import Path

from insenv.core.system import System, TaskKind, Trial

SYSTEM = System(
    name="SlowTable",
    kinds=(TaskKind("slow-north", "rad", "north_gls", "insenv.systems.north_finder.procedure:NorthFinderProcedure"),),
    scenario="slow_table/slow",
    scenarios=Path(__file__).parent / "scenarios",
    home="slow_table",
    task="slow_table.env:slow_table",
    environment="slow_table.env:SlowTableEnv",
    vector="slow_table.env:SlowTableVectorEnv",
    check="insenv.scenario.task:turning_table",
    bound="insenv.systems.north_finder.bound:bound",
    trial=Trial(
        "slow_table/slow", {"duration": "60 s", "instrument.sampling": "20 Hz"}, "north_gls", [(0.2, 30), (-0.2, 30)]
    ),
)
