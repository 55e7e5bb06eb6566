"""The p of the planned comparisons, adjusted for their number in several ways."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from autd_analysis.basics.adjustment import METHODS, Method, adjusted
from autd_analysis.comparisons.numbers import ComparisonResult
from autd_analysis.data.contrasts import Contrast


@dataclass(frozen=True)
class AdjustedP:
    """The p of one test of a planned comparison, adjusted over all tests of that kind.

    Attributes
    ----------
    contrast, test
        What was compared, and by which test.
    tests
        Number of tests of this kind that were made.
    p, by_method
        As it is, and adjusted by each method; None where it could not be made.
    """

    contrast: Contrast
    test: str
    tests: int
    p: float | None
    by_method: Mapping[Method, float | None] = field(hash=False)


def adjusted_p(comparisons: Sequence[ComparisonResult]) -> Iterator[AdjustedP]:
    """Yield the p of the planned tests, adjusted by every method."""
    tests: dict[str, list[float | None]] = {
        "sign_flip": [result.sign_flip.p if result.sign_flip else None for result in comparisons],
        "paired_t": [result.paired_t.p if result.paired_t else None for result in comparisons],
        "mixed_model": [result.mixed_model.p if result.mixed_model else None for result in comparisons],
    }
    for test, p_values in tests.items():
        by_method = {method: adjusted(p_values, method) for method in METHODS}
        made = len(p_values) - p_values.count(None)
        for place, (result, p) in enumerate(zip(comparisons, p_values, strict=True)):
            its = {method: values[place] for method, values in by_method.items()}
            yield AdjustedP(result.contrast, test, made, p, its)
