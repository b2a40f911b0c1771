"""The promised names, each with the module that has it: `insenv/__init__.py` finds them here, and imports on use."""

from collections.abc import Mapping

from insenv.calibration import Calibration as Calibration
from insenv.calibration import calibration as calibration_of
from insenv.calibration import correct as correct
from insenv.calibration import load_calibration as load_calibration
from insenv.close import close as close_loop
from insenv.core.errors import InputError as InputError
from insenv.core.estimate import Datasheet as Datasheet
from insenv.core.estimate import Estimate as Estimate
from insenv.core.motion import Motion as Motion
from insenv.core.recording import Channel as Channel
from insenv.core.recording import Recording as Recording
from insenv.core.system import System as System
from insenv.data.load import read_recordings as read_recordings
from insenv.data.manifest import load_manifest as load_manifest
from insenv.design.designing import design as design_procedure
from insenv.effects.check import check_effect as check_effect
from insenv.envs.rollout import roll_out as roll_out
from insenv.evaluate.check.plugin import check_plugin as check_plugin
from insenv.evaluate.evaluation import evaluate as evaluate_plugins
from insenv.identify.findings import Findings as Findings
from insenv.rate_test import rate_test as run_rate_test
from insenv.report import summary as summary
from insenv.scenario import load as load_scenario
from insenv.scenario import simulate as simulate
from insenv.sensors.chain import Sensor as Sensor
from insenv.settle import settle as settle_scenario

__all__ = [
    "Calibration",
    "Channel",
    "Datasheet",
    "Estimate",
    "Findings",
    "InputError",
    "Motion",
    "Recording",
    "Sensor",
    "System",
    "calibration_of",
    "check_effect",
    "check_plugin",
    "close_loop",
    "correct",
    "design_procedure",
    "evaluate_plugins",
    "load_calibration",
    "load_manifest",
    "load_scenario",
    "read_recordings",
    "roll_out",
    "run_rate_test",
    "settle_scenario",
    "simulate",
    "summary",
]

__version__: str

def _promised() -> Mapping[str, tuple[str, str]]: ...
def _register() -> None: ...
