"""HTML as a tree of elements: what is put in as text comes out escaped, whoever wrote it."""

import re
from xml.etree import ElementTree

from autd_analysis.report.style import BAND, GREY, GRID, INK, NOTE, PAPER, SIGNAL

Element = ElementTree.Element
Content = Element | str

_SVG = "{http://www.w3.org/2000/svg}"
_XLINK = "{http://www.w3.org/1999/xlink}"
# Who made it, which we know; and a style sheet that would hold for the whole page.
_LEFT_OUT = (f"{_SVG}metadata", f"{_SVG}style")
_ROUND = "stroke-linejoin: round; stroke-linecap: butt"
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_OF_THE_PAGE = {
    colour.lower(): f"var(--{name}, {colour.lower()})"
    for name, colour in (
        ("ink", INK),
        ("grey", GREY),
        ("grid", GRID),
        ("band", BAND),
        ("note", NOTE),
        ("signal", SIGNAL),
        ("paper", PAPER),
        ("black", "#000000"),
    )
}
_URL = re.compile(r"url\(#([\w.-]+)\)")


def tag(name: str, *content: Content, **attributes: str) -> Element:
    """Return an element.

    Parameters
    ----------
    name
        As in HTML.
    *content
        Elements and texts in order.
    **attributes
        As in HTML; ``class_`` is class, and an underscore is a hyphen.
    """
    named = {key.rstrip("_").replace("_", "-"): _printable(value) for key, value in attributes.items()}
    element = Element(name, named)
    last: Element | None = None
    for each in content:
        if isinstance(each, str):
            if last is None:
                element.text = (element.text or "") + _printable(each)
            else:
                last.tail = (last.tail or "") + _printable(each)
        else:
            element.append(each)
            last = each
    return element


def wide(element: Element, label: str) -> Element:
    """Return an element that may be wider than the page in a frame that scrolls, also by the keyboard."""
    return tag("section", element, class_="wide", aria_label=label, tabindex="0")


def inline_svg(svg: bytes, name: str, label: str) -> Element:
    """Return a drawing as an element of a page; its greys follow the page's colours, light or dark.

    Parameters
    ----------
    svg
        An SVG that matplotlib wrote.
    name
        A word that no other drawing on the page has; it goes before all ids, which must differ within a page.
    label
        What there is to see, for those who cannot see it.
    """
    drawing = ElementTree.fromstring(svg)  # noqa: S314 - we wrote it ourselves
    for element in drawing.iter():
        for child in list(element):
            if child.tag in _LEFT_OUT:
                element.remove(child)
    for element in drawing.iter():
        element.tag = element.tag.removeprefix(_SVG)
        element.attrib = {
            key.removeprefix(_XLINK): _of(name, key.removeprefix(_XLINK), value)
            for key, value in element.attrib.items()
        }
    referred = {match for element in drawing.iter() for match in _references(element)}
    for element in drawing.iter():
        if element.get("id") not in referred:
            element.attrib.pop("id", None)
    drawing.attrib |= {"role": "img", "aria-label": _printable(label), "style": _ROUND}
    return drawing


def page_text(page: Element) -> str:
    """Return a page as HTML."""
    return "<!DOCTYPE html>\n" + ElementTree.tostring(page, encoding="unicode", method="html") + "\n"


def _of(name: str, key: str, value: str) -> str:
    """Return an attribute's value with the ids in it those of the drawing of that name."""
    if key == "id":
        return f"{name}-{value}"
    if key == "href":
        return f"#{name}-{value.removeprefix('#')}"
    named = _URL.sub(rf"url(#{name}-\1)", value)
    return (
        _COLOUR.sub(lambda found: _OF_THE_PAGE.get(found[0].lower(), found[0]), named)
        if key == "style"
        else named
    )


def _references(element: Element) -> set[str]:
    """Return the ids that an element's attributes refer to."""
    values = " ".join(value for key, value in element.attrib.items() if key != "href")
    return {element.get("href", "").removeprefix("#"), *_URL.findall(values)}


def _printable(text: str) -> str:
    """Return a text without control characters, which HTML forbids."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", text)
