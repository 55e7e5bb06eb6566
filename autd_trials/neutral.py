"""Text from elsewhere, made harmless where a person reads it: on a terminal, in a README."""

import re

UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
"""What commands a terminal, turns the direction of what follows, or has no place in a text file."""

_HTML = re.compile(r"<(?=[A-Za-z/!?])")


def printable(text: str) -> str:
    r"""Return a text that commands no terminal: what would is a replacement character.

    >>> print(printable("thin\x1b[31m"))
    thin\N{REPLACEMENT CHARACTER}[31m
    """
    return UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def markdown(text: str) -> str:
    r"""Return a page of Markdown in which no words of others are HTML.

    >>> markdown("p < .05 <script>")
    'p < .05 &lt;script>'
    """
    return _HTML.sub("&lt;", printable(text))
