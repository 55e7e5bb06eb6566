"""What a person has in a notebook: names that cost nothing, paths in, data frames and axes out."""

import ast
import doctest
import subprocess
import sys
from pathlib import Path

import autd_analysis as aa
import pandas as pd
import pytest
from matplotlib.figure import Figure

from autd_trials.errors import UsageError
from tests.analysis.data.test_foreign_tables import lines

HEAVY = ("numpy", "scipy", "pandas", "matplotlib", "statsmodels", "pydantic")


def test_every_name_is_there_and_importing_them_costs_nothing() -> None:
    program = f"import sys, autd_analysis; print(*(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
    assert set(aa.__all__) <= {*dir(aa), *ast_names()}
    for name in aa.__all__:
        assert getattr(aa, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = aa.nothing


def ast_names() -> set[str]:
    """Names that the module's source imports for types, which a lazy face has not yet."""
    tree = ast.parse(Path(aa.__file__).read_text(encoding="utf-8"))
    return {alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}


def test_the_examples_of_the_documentation_run(recorded_chest: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(recorded_chest.parent)
    found = doctest.testmod(aa)
    assert found.attempted > 5
    assert not found.failed


def test_a_path_as_text_is_enough_and_a_subject_is_an_attribute(recorded_chest: Path) -> None:
    results = aa.analyse(str(recorded_chest), only=["rates", "comparisons"])
    assert {"rates", "comparisons"} <= set(dir(results))
    rates = results.rates.to_frame()
    assert isinstance(rates, pd.DataFrame)
    assert list(rates["modulation_hz"].unique()) == [25.0, 50.0, 100.0]
    assert set(results.rates.tables) == {
        "rates", "rates_by_participant", "false_alarms", "false_alarms_by_participant",
    }  # fmt: skip
    assert len(results.rates.to_frame("rates_by_participant")) == 48
    assert results.rates.found.conditions[0].mean == pytest.approx(rates["rate"][0])
    assert "Detection rate" in repr(results.rates)
    with pytest.raises(UsageError, match="rates has no table means"):
        results.rates.to_frame("means")
    with pytest.raises(AttributeError, match="results have no 'models'; there are: rates, comparisons"):
        _ = results.models


def test_it_draws_on_axes_that_are_given_or_on_its_own(recorded_chest: Path) -> None:
    results = aa.analyse(recorded_chest, only=["rates", "comparisons", "timing", "psychometric"])
    for view in (results.rates, results.comparisons, results.timing, results.psychometric):
        axes = Figure().subplots()
        assert view.plot(ax=axes) is axes
        assert axes.get_ylabel()
        own = view.plot()
        assert own is not None
        assert own.figure.axes[0] is own


def test_what_has_no_results_says_why(recorded_chest: Path) -> None:
    thresholds = aa.analyse(recorded_chest, only=["thresholds"]).thresholds
    for ask in (thresholds.to_frame, thresholds.plot, lambda: thresholds.tables, lambda: thresholds.found):
        with pytest.raises(UsageError, match="no adaptive method"):
            ask()
    assert "no adaptive method" in thresholds.summary


def test_a_table_is_read_with_words_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("\n".join(["pid,felt,cloth,freq", *lines()]) + "\n")
    columns = {"participant": "pid", "response": "felt", "clothing": "cloth", "modulation_hz": "freq"}
    compare = ["clothing=inner,both@modulation_hz", "clothing=both,inner"]
    study = aa.read_table(str(path), columns=columns, compare=compare)
    frame = aa.analyse(study, only=["comparisons"]).comparisons.to_frame()
    assert list(frame["mean_difference"]) == pytest.approx([0.5, 0.5, -0.5])
    assert list(frame["at"][:2]) == ["modulation_hz 25", "modulation_hz 100"]
    assert pd.isna(frame["at"][2])
