"""The scripts that a newcomer would write: each runs, prints one line of result, and draws a picture."""

import re
import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: By script: value, standard deviation and truth in the line that it prints.
SCRIPTS = {
    "find_north": r"azimuth (?P<value>\S+) deg, sd (?P<sd>\S+) arcsec; true (?P<true>\S+) deg",
    "calibrate_sight": r"installation angle (?P<value>\S+) arcmin .* s, sd (?P<sd>\S+) arcmin; true (?P<true>\S+)",
    "measure_scale_factor": r"scale factor (?P<value>\S+) ppm from nominal, sd (?P<sd>\S+) ppm; true (?P<true>\S+) ppm",
}
#: Units of a value in one of its standard deviation.
FINER = {"find_north": 3600.0}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPTS)
def test_a_scenario_script_ends_with_a_result_and_a_picture(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Seeds are fixed in the scripts: the result is within 4 standard deviations, or it is not."""
    monkeypatch.setattr(sys, "argv", [f"{name}.py", str(tmp_path / "picture.png")])
    runpy.run_path(str(ROOT / f"scripts/{name}.py"), run_name="__main__")
    (line,) = capsys.readouterr().out.splitlines()
    said = re.match(SCRIPTS[name], line)
    assert said is not None, line
    value, sd, true = (float(said[key]) for key in ("value", "sd", "true"))
    assert abs(value - true) * FINER.get(name, 1.0) < 4 * sd
    assert (tmp_path / "picture.png").stat().st_size > 20_000


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_scenario_script_is_short_and_stands_in_the_readme(name: str) -> None:
    assert len((ROOT / f"scripts/{name}.py").read_text(encoding="utf-8").splitlines()) < 40
    assert f"scripts/{name}.py" in (ROOT / "README.md").read_text(encoding="utf-8")
