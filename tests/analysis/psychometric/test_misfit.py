"""Functions that do not fit are remarked; those that fit are not, however many they are."""

from pathlib import Path

import numpy as np
from autd_analysis.psychometric.misfit import misfits
from autd_analysis.psychometric.numbers import all_psychometric_results
from autd_analysis.reading import read_table

LEVELS = (0.5, 1, 2, 4, 8)


def said(path: Path, rates: list[list[float]], trials: int = 30) -> list[str]:
    """Return what is said of people with these rates at each level."""
    lines = [
        f"P{person},{level},{round(rate * trials)},{trials}"
        for person, its_rates in enumerate(rates)
        for level, rate in zip(LEVELS, its_rates, strict=True)
    ]
    path.write_text("\n".join(["who,amp,k,n", *lines]))
    return list(misfits(all_psychometric_results(read_table(path, columns="participant=who,felt=k,n,amp"))))


def test_a_function_that_does_not_fit_is_said(tmp_path: Path) -> None:
    (sentence,) = said(tmp_path / "t.csv", [[0.1, 0.9, 0.1, 0.9, 0.5]])
    assert sentence.startswith("1 of 1 psychometric functions along amp do not fit the answers (deviance p")
    assert "--core weibull" in sentence


def test_functions_that_fit_are_not_said_to_misfit(tmp_path: Path) -> None:
    chance = np.random.default_rng(3)
    right = 1 / (1 + np.exp(-2 * np.log2(np.array(LEVELS) / 2)))
    rates = [list(chance.binomial(30, right) / 30) for _ in range(6)]
    assert said(tmp_path / "t.csv", rates) == []
    assert len(said(tmp_path / "u.csv", [*rates, [0.1, 0.9, 0.1, 0.9, 0.5]])) == 1
