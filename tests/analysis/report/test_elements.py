"""Elements: texts escaped, drawings with ids of their own."""

from autd_analysis.report.elements import inline_svg, page_text, tag

SVG = """<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="10" height="10">
 <metadata><a/></metadata>
 <defs><style>*{fill: red}</style><path id="glyph" d="M 0 0"/><clipPath id="clip"><path d="M 1 1"/></clipPath>
 <pattern id="hatch"/></defs>
 <g id="unused" clip-path="url(#clip)"><use xlink:href="#glyph" style="fill: #222222; stroke: url(#hatch)"/>
 </g></svg>"""


def test_texts_and_attributes_are_escaped() -> None:
    made = tag("p", "a < b & ", tag("b", "<i>"), "\x00 tail", title='"<>', class_="x", aria_label="y")
    assert page_text(made) == (
        '<!DOCTYPE html>\n<p title="&quot;<&gt;" class="x" aria-label="y">a &lt; b &amp; <b>&lt;i&gt;</b>'
        "\N{REPLACEMENT CHARACTER} tail</p>\n"
    )


def test_ids_are_the_drawings_own_and_colours_stay() -> None:
    text = page_text(inline_svg(SVG.encode(), "one", 'a "label"'))
    assert 'id="one-glyph"' in text
    assert 'href="#one-glyph"' in text
    assert 'id="one-clip"' in text
    assert 'clip-path="url(#one-clip)"' in text
    assert "fill: var(--ink, #222222); stroke: url(#one-hatch)" in text
    assert 'id="one-hatch"' in text
    assert "unused" not in text
    assert "red" not in text
    assert "metadata" not in text
    assert 'aria-label="a &quot;label&quot;"' in text
