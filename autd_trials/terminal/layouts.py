"""Which key of the keyboard a character comes from, on layouts whose letters are not Latin.

A terminal tells characters, not keys. An experimenter whose keyboard is set to Russian gets a Cyrillic letter
from the key that is labelled A, and must be able to abort all the same. So each character is taken for the
letter at its place on the US layout. The tables were written down from the published layouts and not tried on
keyboards of each kind. A letter that lies on two keys, on different layouts, means either.
"""

import unicodedata
from collections import defaultdict

_US = "qwertyuiopasdfghjklzxcvbnm"
_LAYOUTS = (
    "йцукенгшщзфывапролдячсмить",  # Russian
    "йцукенгшщзфівапролдячсмить",  # Ukrainian
    "љњертзуиопасдфгхјклѕџцвбнм",  # Serbian
    ";ςερτυθιοπασδφγηξκλζχψωβνμ",  # Greek
    "/'קראטוןםפשדגכעיחלךזסבהנמצ",  # Hebrew
    "ضصثقفغعهخحشسيبلاتنمئءؤر\0ىة",  # Arabic; its B types two letters
    "ضصثقفغعهخحشسیبلاتنمظطزرذدپ",  # Persian
    "ㅂㅈㄷㄱㅅㅛㅕㅑㅐㅔㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ",  # Korean
    "ㅃㅉㄸㄲㅆㅛㅕㅑㅒㅖㅁㄴㅇㄹㅎㅗㅓㅏㅣㅋㅌㅊㅍㅠㅜㅡ",  # Korean, shifted
    "たていすかんなにらせちとしはきくまのりつさそひこみも",  # Japanese kana
    "ๆไำพะัีรนยฟหกดเ้่าสผปแอิืท",  # Thai
    "ㄆㄊㄍㄐㄔㄗㄧㄛㄟㄣㄇㄋㄎㄑㄕㄘㄨㄜㄠㄈㄌㄏㄒㄖㄙㄩ",  # Chinese Zhuyin
    "ქწერტყუიოპასდფგჰჯკლზხცვბნმ",  # Georgian
    "ौैाीूबहगदजोे्िुपरकतॆंमनवलस",  # Hindi InScript
)
_KATAKANA_TO_HIRAGANA = ord("ァ") - ord("ぁ")


def _positions() -> dict[str, frozenset[str]]:
    found: defaultdict[str, set[str]] = defaultdict(set)
    for layout in _LAYOUTS:
        for letter, us in zip(layout, _US, strict=True):
            if letter.isalpha() or unicodedata.category(letter).startswith("M"):
                found[letter].add(us)
    return {letter: frozenset(keys) for letter, keys in found.items()}


_POSITIONS = _positions()


def keys_of(character: str) -> frozenset[str]:
    """Return the keys from which a character may come, each as the US layout types it without shift.

    Upper case, full width (an input method's), and blanks of any kind are taken for their key; Ctrl with the
    space bar, which types NUL, is the space bar. Empty where the key is not known.
    """
    if character.lower() in _POSITIONS:  # before normalization, which takes some letters apart
        return _POSITIONS[character.lower()]
    plain = " " if character == "\0" else unicodedata.normalize("NFKC", character).lower()
    if len(plain) != 1:
        return frozenset()
    if "ァ" <= plain <= "ヶ":
        plain = chr(ord(plain) - _KATAKANA_TO_HIRAGANA)
    if plain in _POSITIONS:
        return _POSITIONS[plain]
    if plain.isspace() and plain not in "\n\t":
        return frozenset(" ")
    return frozenset(plain) if plain.isascii() or plain.isprintable() else frozenset()
