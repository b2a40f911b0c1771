"""Close the loop on a measured recording, or where it cannot be had on a simulated one; say what was found.

The recording is that of a ring-laser unit in a parked vehicle; the declared model of its accelerometers has a
constant and nothing else. Ends with the verdict, the error before and after on data that no fit saw, and the
path of the HTML report.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from insenv import datasets
from insenv.close import close
from insenv.core.console.progress import Progress
from insenv.core.errors import InputError
from insenv.core.quantities import unit_for
from insenv.identify.findings import Findings, TargetFindings
from insenv.report import summary, write_html, write_json
from insenv.report.figures import overview

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "out" / "demo"
RECORDING = "psins_lasergyro"
SCENARIO = ROOT / "scenarios" / "parked_vehicle.toml"
#: How long the server of the recording may stay silent [s].
PATIENCE = 5.0


def main() -> None:
    options = _options()
    try:
        OUT.mkdir(parents=True, exist_ok=True)
        manifest = _simulated() if options.simulated else _measured() or _simulated()
        found = close(manifest, progress=Progress())
        report = write_html(found, OUT / "report.html")
        write_json(found, OUT / "report.json")
        if options.picture:
            _draw(found, options.picture)
    except InputError as error:
        sys.exit(f"demo: {error}")
    print(f"\n{summary(found)}\n\n{_ending(found, report)}")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--simulated", action="store_true", help="simulate, even where the recording is here")
    parser.add_argument("--picture", type=Path, metavar="PATH.png", help="draw before and after as a picture")
    return parser.parse_args()


def _measured() -> str | None:
    """Name of the measured recording; None, having said so, where it cannot be had."""
    try:
        folder = datasets.locate(RECORDING) or datasets.fetch(RECORDING, timeout=PATIENCE)
        datasets.load(RECORDING)
    except InputError as error:
        print(f"The measured recording cannot be had, so one is simulated instead. ({error})")
        return None
    print(f"Measured recording: {datasets.describe(RECORDING)}, in {folder}")
    return RECORDING


def _simulated() -> Path:
    """Manifest of a simulated recording of the same kind: the tilt of the vehicle is not declared."""
    from insenv.scenario import simulate

    print(f"Simulated recording: {SCENARIO.relative_to(ROOT)}, whose base_tilt the model does not declare")
    return simulate(SCENARIO, OUT)


def _draw(found: Findings, path: Path) -> None:
    """Write residual before and after and their spectra, whole or not at all."""
    beside = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        overview(found.targets[0]).savefig(beside, format="png", dpi=110)
        os.replace(beside, path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error


def _ending(found: Findings, report: Path) -> str:
    lines = [f"Verdict: {found.verdict}", *map(_before_and_after, found.targets), f"Report: {report}"]
    return "\n".join(lines)


def _before_and_after(target: TargetFindings) -> str:
    h = target.held_out
    unit = unit_for(h.unit, h.before, h.after)
    added = ", ".join(dict.fromkeys(added.effect for added in target.added)) or "nothing"
    error = f"{unit.show(h.before)} before, {unit.show(h.after)} after"
    return f"{target.target}: held-out error of {h.averaging:.3g} s means {error} adding {added}"


if __name__ == "__main__":
    main()
