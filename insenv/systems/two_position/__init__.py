"""Two-position calibration of a vehicle's sight and INS: what it is to every command (`insenv.core.system`)."""

from __future__ import annotations

from pathlib import Path

from insenv.core.system import System, TaskKind, Trial

SYSTEM = System(
    name="TwoPosition",
    kinds=(
        TaskKind(
            "two-position",
            "rad",
            "two_position_tied",
            "insenv.systems.two_position.procedure:TwoPositionProcedure",
            policies=(
                "three_rests",
                "published_schedule",
                "covariance_triggered",
                "horizon_two_position",
                "greedy_two_position",
            ),
        ),
    ),
    scenario="two_position/published_a",
    scenarios=Path(__file__).parent / "scenarios",
    home="two_position",
    task="insenv.systems.two_position.env:two_position",
    environment="insenv.systems.two_position.env:made",
    vector="insenv.systems.two_position.env:TwoPositionVectorEnv",
    check="insenv.systems.two_position.check:check",
    bound="insenv.systems.two_position.bound:bound",
    scene="insenv.systems.two_position.scene:SCENE",
    trial=Trial(
        "two_position/published_a2",
        {"duration": "120 s", "task.step": "2 s", "instrument.sampling": "20 Hz", "sight.readings": "turns"},
        "two_position_tied",
        [(0.0, 25), (170 / 180, 1), (0.0, 34)],
    ),
)
