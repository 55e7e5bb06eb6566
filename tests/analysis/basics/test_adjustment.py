"""Adjusted p values against statsmodels and by hand."""

import pytest
from autd_analysis.basics.adjustment import METHODS, Method, adjusted, holm
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats.multitest import multipletests

STATSMODELS: dict[Method, str] = {
    "bonferroni": "bonferroni",
    "holm": "holm",
    "hochberg": "simes-hochberg",
    "benjamini_hochberg": "fdr_bh",
}


@pytest.mark.parametrize("method", METHODS)
@given(p_values=st.lists(st.one_of(st.none(), st.floats(0, 1)), max_size=12))
@settings(max_examples=20, deadline=None)  # statsmodels collects garbage in every call: 0.1 s each
def test_equals_statsmodels_on_the_tests_that_were_made(method: Method, p_values: list[float | None]) -> None:
    found = adjusted(p_values, method)
    assert [value is None for value in found] == [value is None for value in p_values]
    made = [p for p in p_values if p is not None]
    if made:
        expected = multipletests(made, method=STATSMODELS[method])[1]
        assert [value for value in found if value is not None] == pytest.approx(list(expected))


def test_holm_by_hand() -> None:
    assert holm([0.01, None, 0.04, 0.03]) == pytest.approx([0.03, None, 0.06, 0.06])


def test_benjamini_and_hochbergs_own_example() -> None:
    # Benjamini and Hochberg (1995), section 3.1: of these 15 the first four are found at 5 %.
    small = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459]
    p = [*small, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0]
    found = [value is not None and value <= 0.05 for value in adjusted(list(p), "benjamini_hochberg")]
    assert found == [True] * 4 + [False] * 11
    with_bonferroni = [value is not None and value <= 0.05 for value in adjusted(list(p), "bonferroni")]
    assert with_bonferroni == [True] * 3 + [False] * 12
