"""Makes the README's pictures from a simulated study: ``make images``."""

import io
import re
import shutil
import tempfile
from pathlib import Path

from rich.console import Console

from analysis.output import write_results
from analysis.study import analyse
from autd_trials.cli import run_protocol
from autd_trials.console.screen import render
from autd_trials.console.status import Status, fold
from autd_trials.records.log import read_log
from autd_trials.session.events import StimulusStart

_IMAGES = Path(__file__).parent / "images"
_SHOWN_TRIAL = 18
_AFTER_ONSET_S = 0.6


def main() -> None:
    """Run the study as `make demo` does, and draw its figure and the screen in the middle of a session."""
    _IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        run_protocol(["chest", "--simulate", "8", "--seed", "1", "--data", folder])
        study = Path(folder, "chest")
        write_results(analyse(study), study / "results")
        shutil.copy(study / "results" / "rates.png", _IMAGES / "chest.png")
        _draw_screen(next(study.glob("sourcedata/sub-sim01/*/*_log.jsonl")))


def _draw_screen(log: Path) -> None:
    status, onset_t_s = Status(), 0.0
    for event in read_log(log).events:
        status = fold(status, event)
        if isinstance(event, StimulusStart) and event.trial == _SHOWN_TRIAL:
            onset_t_s = event.onset_t_s
            break
    console = Console(record=True, width=110, file=io.StringIO(), force_terminal=True)
    console.print(render(status, onset_t_s + _AFTER_ONSET_S, unblind=False))
    drawing = console.export_svg(title="run-protocol chest.yaml")
    own = re.sub(r"@font-face \{.*?\}", "", drawing, flags=re.DOTALL)  # no fonts from the web
    (_IMAGES / "screen.svg").write_text(own, encoding="utf-8")


if __name__ == "__main__":
    main()
