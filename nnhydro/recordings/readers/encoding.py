"""The encoding of a text file: by its byte-order mark, else UTF-8, else the code page in which its words look like words.

Headers are short, so statistics of languages guess badly: `[°]` in Windows-1252 becomes a Chinese character. Western letters stand alone
among ASCII ones; an alphabet of its own shows as whole words of bytes above 127, and in the wrong code page their cases are mixed.
"""

import codecs
import re
import unicodedata
from pathlib import Path

from nnhydro.errors import RecordingError

SAMPLE = 65_536  # bytes that tell the encoding
BOMS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"))
WESTERN, CENTRAL = "cp1252", "cp1250"
ALPHABETS = {"cp1251": "CYRILLIC", "koi8_r": "CYRILLIC", "cp1253": "GREEK", "iso8859_7": "GREEK"}
EASTERN = ("shift_jis", "gb18030", "euc_kr", "big5", "euc_jp")
SIGNS = "\N{DEGREE SIGN}\N{MICRO SIGN}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}\N{MIDDLE DOT}"  # what stands beside letters in a unit
_OTHER_ALPHABET = re.compile(rb"[\x80-\xff]{3}")  # bytes: no western word has three accents in a row
_LINES = re.compile(rb"[^\r\n]*[\x80-\xff][^\r\n]*")
_WORD = re.compile(r"[^\W\d_]+")
_BROKEN_WORD = re.compile(rf"[A-Za-z][^\x00-\x7f{SIGNS}][A-Za-z]|[A-Za-z]{{2}}[^\x00-\x7f{SIGNS}]")


def encoding_of(path: Path) -> str:
    """Return the encoding of the text file `path`; raises RecordingError where none is recognised."""
    with path.open("rb") as file:
        sample = file.read(SAMPLE)
    marked = next((name for bom, name in BOMS if sample.startswith(bom)), "")
    if marked:
        return marked
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    if max(even, odd) > 0.4 * len(sample) / 2 and min(even, odd) < 0.05 * len(sample) / 2:
        return "utf-16-le" if odd > even else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)
        return "utf-8"
    except UnicodeDecodeError as cause:
        place = cause.start
    found = "" if b"\0" in sample else code_page(sample)
    if found:
        return found
    raise RecordingError(f"{path}: is not UTF-8 text (byte {place}), nor in any encoding that can be recognised: save it as UTF-8 CSV "
                         "or as Parquet")


def code_page(sample: bytes) -> str:
    """Return the code page of `sample`, whose bytes above 127 are not UTF-8; "" where none is plausible."""
    sample = b"\n".join(_LINES.findall(sample)[:20])  # numbers say nothing
    if not _plain(sample):
        return ""
    if _OTHER_ALPHABET.search(sample):
        natural = [name for name, script in ALPHABETS.items() if _natural(_decode(sample, name), script)]
        fewest = min((_capitals(sample, name) for name in natural), default=0)  # small letters of one page are capitals of another
        natural = [name for name in natural if _capitals(sample, name) == fewest]
        found = natural if len(natural) == 1 else [*_guess(sample, natural or list(EASTERN)), *natural]
        if found:
            return found[0]
    western, central = _decode(sample, WESTERN), _decode(sample, CENTRAL)
    if western is None or (central is not None and _broken(western) and not _broken(central)):
        return CENTRAL if central is not None else next(iter(_guess(sample, [])), "")
    return WESTERN


def _plain(sample: bytes) -> bool:
    """Whether the bytes are text at all: no control characters but tabs and line ends."""
    return not re.search(rb"[\x00-\x08\x0e-\x1f]", sample)


def _decode(sample: bytes, name: str) -> str | None:
    try:
        return sample.decode(name)
    except UnicodeDecodeError:
        return None


def _natural(text: str | None, script: str) -> bool:
    """Whether every word with foreign letters is of one `script`, in small letters, capitals, or with one capital in front."""
    if text is None or any(not letter.isascii() and not letter.isalpha() and letter not in SIGNS for letter in text):
        return False
    words = [word for word in _WORD.findall(text.replace("\N{MICRO SIGN}", "u")) if not word.isascii()]
    return all(all(unicodedata.name(letter, "").startswith(script) for letter in word) for word in words) and all(
        word[1:] == word[1:].lower() or word == word.upper() for word in words)


def _capitals(sample: bytes, name: str) -> int:
    """Number of words in capitals throughout."""
    return sum(len(word) > 1 and word == word.upper() for word in _WORD.findall(sample.decode(name)))


def _broken(text: str) -> bool:
    """Whether a sign that is no letter stands within or behind a word, as the letters of another code page would."""
    return any(not match[0][1:].strip().isalpha() for match in _BROKEN_WORD.finditer(text))


def _guess(sample: bytes, among: list[str]) -> list[str]:
    """The encoding that a library of language statistics finds likeliest, `among` some or all; none where it finds none."""
    from charset_normalizer import from_bytes

    found = from_bytes(sample, cp_isolation=among or None).best()
    return [] if found is None else [str(found.encoding)]
