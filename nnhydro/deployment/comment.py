"""Text for the comments of exported files: names come from files of others, and may not end the comment that they stand in."""

import re


def comment_text(text: str) -> str:
    """Return `text` so that it can stand in a comment of C or XML: printable, without the marks that begin or end one."""
    printable = "".join(letter if letter.isprintable() or letter == "\n" else "\N{REPLACEMENT CHARACTER}" for letter in text)
    return re.sub(r"\*(?=/)|/(?=\*)|-(?=-)", r"\g<0> ", printable)
