"""What closing the loop found, kept as an object that corrects recordings.

    corrected = measured - sum_i e_i(u, motion; theta_i)

``e_i`` are the declared effects and those that the loop added (`insenv.effects`), at the parameters that the loop
estimated; ``u`` is the input rate that the reference tells or, where there is none, the corrected output itself.

What is taken out of a recording depends on which one it is; `insenv.calibration.rules` says how.
"""

from insenv.calibration.apply import Applied
from insenv.calibration.contents import SCHEMA, Parameter, Run, Target, Term
from insenv.calibration.make import calibration
from insenv.calibration.model import Calibration, load_calibration
from insenv.calibration.write import correct

__all__ = [
    "SCHEMA",
    "Applied",
    "Calibration",
    "Parameter",
    "Run",
    "Target",
    "Term",
    "calibration",
    "correct",
    "load_calibration",
]
