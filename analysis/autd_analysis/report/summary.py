"""A short reading of the results for the terminal."""

from collections.abc import Iterator

from autd_analysis.report.wording import SIMULATED
from autd_analysis.results import Results


def plain_words(results: Results) -> str:
    """Return the results in plain words: what each subject says, and the remarks.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    str
        Several lines without a final newline.
    """
    blocks = [tuple(_heading(results)), *(view.summary for view in results.views)]
    if results.remarks:
        remarks = (f"  - {remark}" for remark in results.remarks)
        blocks.append(("To know before using these numbers:", *remarks))
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _heading(results: Results) -> Iterator[str]:
    trials = results.trials
    kind = "simulated " if trials.simulated else ""
    yield (
        f"{trials.design.protocol}: {len(trials.participants)} {kind}participant(s), "
        f"{trials.sessions} session(s), {int(trials.table['used'].sum())} trials counted"
    )
    if trials.simulated:
        yield SIMULATED
