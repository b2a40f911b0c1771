"""Calibration of a whole inertial unit on a table of several axes: what it is to every command."""

from __future__ import annotations

from pathlib import Path

from insenv.core.system import System, TaskKind, Trial

SYSTEM = System(
    name="SystemCalibration",
    kinds=(
        TaskKind(
            "system-calibration",
            "1",
            "batch_gls",
            "insenv.systems.system_calibration.procedure:SystemProcedure",
            policies=(
                "nineteen_positions",
                "designed_sequence",
                "greedy_orientation",
                "horizon_orientation",
                "twenty_four_positions",
                "six_positions",
            ),
        ),
    ),
    scenario="system_calibration/tactical_fog",
    scenarios=Path(__file__).parent / "scenarios",
    home="system_calibration",
    task="insenv.systems.system_calibration.env:system_calibration",
    environment="insenv.systems.system_calibration.env:made",
    vector="insenv.systems.system_calibration.env:SystemCalibrationVectorEnv",
    check="insenv.systems.system_calibration.check:check",
    bound="insenv.systems.system_calibration.bound:bound",
    trial=Trial(
        "system_calibration/tactical_fog",
        {"duration": "60 s", "task.step": "2 s", "instrument.sampling": "20 Hz"},
        "batch_gls",
        [(0.25, 8), (-0.25, 8), (0.0, 14)],
    ),
    scene="insenv.systems.system_calibration.scene:scene",
    plants={"axes": "insenv.systems.system_calibration.table:MAKER"},
)
