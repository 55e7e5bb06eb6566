"""What the pages' makers have in common: replacing what stands between marks in a page."""

import re
from pathlib import Path


def fill(page: Path, maker: str, contents: dict[str, str]) -> None:
    """Replace what stands between each of a page's pairs of marks, and write the page."""
    text = page.read_text(encoding="utf-8")
    for name, content in contents.items():
        mark = f"<!-- made by docs/{maker}: {name} -->"
        pattern = re.compile(f"{re.escape(mark)}.*?<!-- end -->", re.DOTALL)
        assert pattern.search(text), mark
        text = pattern.sub(f"{mark}\n\n{content}\n\n<!-- end -->".replace("\\", r"\\"), text)
    page.write_text(text, encoding="utf-8")
