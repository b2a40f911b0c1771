"""Pictures of reports, and what they are drawn from."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_findings import (
    gyro,
)
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from insenv.report import (
    binning,
    drawing,
    figures,
)
from insenv.report.svg import _lay_out


def test_bins_mean_what_they_hold() -> None:
    x = np.repeat([0.0, 1.0, 2.0], [4, 4, 2])
    b = binning.means(x, np.array([1, 2, 3, 4, 5, 5, 5, 5, 9, 9.0]), 3)
    assert b.mean.tolist() == pytest.approx([2.5, 5.0, np.nan], nan_ok=True)
    assert b.error[:2].tolist() == pytest.approx([np.std([1, 2, 3, 4], ddof=1) / 2, 0.0])


def test_runs_stand_one_after_the_other_only_where_they_overlap() -> None:
    traces = gyro(60).traces
    line = binning.timeline(traces)
    assert (np.diff(line.x) > 0).all()
    later = replace(traces, t=np.linspace(5.0, 6.0, 60))
    np.testing.assert_array_equal(binning.timeline(later).x, later.t)


def test_an_averaged_spectrum_keeps_its_level() -> None:
    # White noise of density 1: 20000 exponential values; the mean over all bins is within 5 sigma (p < 1e-6).
    rng = np.random.default_rng(3)
    f = np.arange(1, 20001) / 100.0
    at, density = binning.smoothed(f, rng.exponential(size=len(f)))
    assert len(at) < 150
    assert abs(density[-1] - 1) < 5 / np.sqrt(1800)
    assert (np.diff(at) > 0).all()


def test_the_overview_shows_time_and_spectrum() -> None:
    left, right = figures.overview(gyro(60)).axes
    assert (left.get_xlabel(), left.get_ylabel()) == (
        "time, runs one after the other [s]",
        "residual [deg/h]",
    )
    assert (right.get_xlabel(), right.get_ylabel()) == ("frequency [Hz]", "two-sided root PSD [(deg/h)/√Hz]")


@pytest.mark.parametrize("low", [1e-9, 1e-3, 0.03, 0.5, 1.7, 4000.0])
@pytest.mark.parametrize("ratio", [1.3, 3.0, 9.0, 40.0, 900.0, 1e5, 1e9, 1e14])
def test_labels_of_logarithmic_axes_are_few_and_do_not_overlap(low: float, ratio: float) -> None:
    spectra = gyro(60).spectra
    tau, deviation = np.geomspace(low, low * ratio, 30), np.geomspace(1e-7, 1e-7 * ratio, 30)
    made = replace(
        spectra, tau=tau, allan_before=deviation, allan_after=deviation, allan_lower=deviation,
        allan_upper=deviation, allan_fitted=deviation, allan_declared=None,
    )  # fmt: skip
    figure = figures.allan(replace(gyro(60), spectra=made))
    _lay_out(figure)
    (ax,) = figure.axes
    for axis, (first, last), side in ((ax.xaxis, ax.get_xlim(), "x"), (ax.yaxis, ax.get_ylim(), "y")):
        boxes = [t.label1.get_window_extent() for t in axis.get_major_ticks() if t.label1.get_text()]
        edges = sorted((getattr(b, f"{side}0"), getattr(b, f"{side}1")) for b in boxes)
        assert 2 <= len(boxes) <= 8
        assert all(a[1] < b[0] for a, b in zip(edges, edges[1:], strict=False)), (side, low, ratio)
        assert all(first <= tick <= last for tick in drawing.log_ticks(first, last))
        assert not any(label.get_text() for label in axis.get_minorticklabels())


def test_one_decade_is_labelled_in_plain_numbers() -> None:
    assert drawing.log_ticks(1.8, 52.0) == [2.0, 5.0, 10.0, 20.0, 50.0]


@pytest.mark.parametrize("size", [1e-7, 1e-3, 1.0, 1e4])
def test_a_residual_of_any_size_needs_no_factor_that_the_legend_would_hide(size: float) -> None:
    target = gyro(60)
    traces = replace(target.traces, before=size * target.traces.before, after=size * target.traces.after)
    figure = figures.against_time(replace(target, traces=traces))
    _lay_out(figure)
    assert [ax.yaxis.get_offset_text().get_text() for ax in figure.axes] == ["", ""]


def test_a_table_that_only_swings_is_drawn_about_its_middle() -> None:
    target = gyro(600)
    swing = np.mod(np.deg2rad(12.0) * np.sin(np.arange(600.0)), 2 * np.pi)
    traces = replace(target.traces, covariates={"angle": swing})
    low, high = figures.against(replace(target, traces=traces), "angle").axes[-1].get_xlim()
    assert -16 < low < -12 and 12 < high < 16
    assert figures.against(target, "angle").axes[-1].get_xlim() == (0, 360)


def test_figures_cope_with_hardly_any_data() -> None:
    target = gyro(60)
    short = {name: getattr(target.traces, name)[:1] for name in ("t", "run", "held_out", "before", "after")}
    figures.against_time(
        replace(target, traces=replace(target.traces, covariates={}, **short))
    ).draw_without_rendering()


def test_drawing_is_lazy_and_leaves_pyplot_alone() -> None:
    code = (
        "import sys, insenv.report as report\n"
        "assert not {'matplotlib', 'jinja2'} & set(sys.modules), 'imported too early'\n"
        "from made_findings import nothing_significant\n"
        "report.to_html(nothing_significant())\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    here = Path(__file__).parents[1] / "cases"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=here, env={"PYTHONPATH": f"{here}:{here.parents[1]}"})


def test_the_points_of_a_cloud_are_in_a_picture_of_pixels() -> None:
    figure = Figure(figsize=(4, 3), facecolor="white")
    canvas = FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    ax.axis("off")
    drawing.cloud(ax, np.linspace(0.0, 1.0, 100), np.random.default_rng(8).standard_normal(100), drawing.BEFORE)
    canvas.draw()
    assert np.any(np.asarray(canvas.buffer_rgba())[..., 2] < 200, axis=0).sum() > 90
