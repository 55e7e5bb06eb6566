"""How a planned comparison is answered in a sentence, whatever was compared: what a report opens with."""

from collections.abc import Iterator

from autd_analysis.basics.paired import PairedT, SignFlip
from autd_analysis.report.wording import format_number, format_p, p_equals

CLEAR = 0.05
RULE = (
    "A difference is called clear where the exact sign-flip test (the paired t test, where there is none) "
    "gives a p of at most .05 after adjustment by Holm's method over all planned comparisons."
)


def change_words(
    sign: int,
    test: SignFlip | None,
    adjusted: float | None,
    tests: int,
    words: tuple[str, str, str],
) -> str:
    """Return which way a difference goes, if it is clear, or if no difference could have been.

    Parameters
    ----------
    sign
        Of the difference as it is printed.
    test
        The exact test, where there is one.
    adjusted
        The adjusted p of the test that decides.
    tests
        How many tests it was adjusted over.
    words
        For a positive difference, a negative one, and none that is clear.
    """
    more, less, none = words
    observed = {1: more, -1: less}.get(sign, none)
    if adjusted is not None and adjusted <= CLEAR:
        return observed
    if sign and test and tests * test.floor > CLEAR:
        return f"{observed}, but so few participants cannot make it clear"
    return none


def test_words(
    sign_flip: SignFlip | None,
    sign_flip_adjusted: float | None,
    paired_t: PairedT | None,
    paired_t_adjusted: float | None,
) -> Iterator[str]:
    """Yield the test that decides, with its adjusted p; nothing where none could be made."""
    if sign_flip:
        yield (
            f"exact sign-flip {p_equals(sign_flip.p)} (least possible {format_p(sign_flip.floor)}), adjusted "
            f"{p_equals(sign_flip_adjusted)}"
        )
    elif paired_t:
        yield (
            f"t({paired_t.df}) = {format_number(paired_t.t)}, {p_equals(paired_t.p)}, adjusted "
            f"{p_equals(paired_t_adjusted)}"
        )
