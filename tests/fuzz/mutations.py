"""Changed copies of valid files: bytes, tokens and lines that damage, malice and carelessness put there."""

import random
import re

NUMBERS = (b"nan", b"NaN", b"inf", b"-Infinity", b"1e300", b"-1e300", b"1e999", b"5e-324", b"-0.0", b"1e-310", b"0", b"-1", b"1e9",
           b"4294967296", b"9223372036854775808", b"9" * 400, b"1" + b"0" * 5000, b"0x1F", b"1_000", b"1,5", b"12:30:00", b"true", b"null",
           b"''", b"[]", b"{}", b"1e4", b"1000000", b"0.5", b"2", b"3")
WORDS = (b"../../../../etc/passwd", b"/dev/zero", b"a/b", b"..", b".", b"CON", b"\xc3\xa9", b"\xff\xfe", b"\x00", b"\xed\xa0\x80", b"%s%n",
         b"__class__", b"!!python/object/apply:os.system ['true']", b"&a [*a]", b"*a", b"<<: *a", b"- - - -", b"[" * 2000,
         b"{a: " * 500, b'"' * 99, b"<!DOCTYPE x [<!ENTITY a 'b'>]>", b"&lt;&#0;", b"\n\n---\n", b"? ", b"| \n ", b"'''",
         b"x" * 3000, b"0" * 3000, b",,,,", b";", b"\t", b"\r")
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*")


def _token(data: bytes, rng: random.Random) -> bytes:
    """One number or word of the text replaced."""
    kind, pool = (NUMBER, NUMBERS) if rng.random() < 0.6 else (WORD, WORDS)
    found = list(kind.finditer(data[:20_000]))
    if not found:
        return data + rng.choice(pool)
    here = rng.choice(found)
    other = rng.choice(found).group() if rng.random() < 0.3 else rng.choice(pool if rng.random() < 0.8 else NUMBERS + WORDS)
    return data[:here.start()] + other + data[here.end():]


def _line(data: bytes, rng: random.Random) -> bytes:
    """A line left out, twice, moved, or cut."""
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    kind = rng.randrange(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, rng.choice(lines))
    elif kind == 2:
        other = rng.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    else:
        lines[at] = lines[at][:rng.randrange(len(lines[at]) + 1)]
    return b"\n".join(lines)


def _bytes(data: bytes, rng: random.Random) -> bytes:
    """Bits flipped, bytes and words of four set, pieces left out, twice, cut or inserted."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        if not changed:
            return bytes(changed)
        at, kind = rng.randrange(len(changed)), rng.randrange(8)
        if kind == 0:
            changed[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            changed[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        elif kind == 2:
            changed[at:at + 4] = rng.choice((b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\x40", b"\x01\0\0\0"))
        elif kind == 3:
            changed[at:at + 8] = rng.choice((b"\0" * 8, b"\xff" * 8, b"\xff" * 7 + b"\x7f", b"\0\0\0\0\1\0\0\0", b"\0" * 6 + b"\xf0\x7f"))
        elif kind == 4:
            del changed[at:at + rng.choice((1, 2, 4, 8, 64))]
        elif kind == 5:
            changed[at:at] = changed[at:at + rng.choice((1, 4, 16, 64))]
        elif kind == 6:
            changed[at:at] = bytes(rng.randrange(256) for _ in range(rng.choice((1, 2, 8))))
        else:
            del changed[at:]
    return bytes(changed)


def mutated(data: bytes, rng: random.Random, text: bool) -> bytes:
    """Return a changed copy of the file `data`; of text mostly its tokens and lines, else its bytes."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        change = _bytes if not text or rng.random() < 0.15 else _token if rng.random() < 0.75 else _line
        data = change(data, rng)
    return data[:200_000]
