"""From trials to numbers, tables, figures and a report.

>>> import autd_analysis as aa
>>> study = aa.read_study("chest")
>>> results = aa.analyse(study, only=["rates", "comparisons"])
>>> rates = results.rates.to_frame()
>>> list(rates.columns[:3])
['modulation_hz', 'clothing', 'rate']
>>> comparisons = results.comparisons.to_frame()
>>> axes = results.comparisons.plot()
"""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_analysis.data.trials import Trials
    from autd_analysis.reading import read_study, read_table
    from autd_analysis.report.figure_options import FigureOptions, labelled_trials
    from autd_analysis.report.writing import write_results
    from autd_analysis.results import Results
    from autd_analysis.study import SUBJECTS, analyse
    from autd_analysis.subject import Subject

__all__ = [
    "SUBJECTS",
    "FigureOptions",
    "Results",
    "Subject",
    "Trials",
    "analyse",
    "labelled_trials",
    "read_study",
    "read_table",
    "write_results",
]

__getattr__ = lazy(
    __name__,
    {
        "SUBJECTS": "study",
        "FigureOptions": "report.figure_options",
        "Results": "results",
        "Subject": "subject",
        "Trials": "data.trials",
        "analyse": "study",
        "labelled_trials": "report.figure_options",
        "read_study": "reading",
        "read_table": "reading",
        "write_results": "report.writing",
    },
)
