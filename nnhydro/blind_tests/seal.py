"""Sealed answers: unreadable without the key, and not to be changed afterwards.

    iv      = HMAC-SHA256(key, "iv" | name | text)[:16]               the same answer under the same key gives the same bytes
    stream  = SHAKE-256("stream" | key | iv)                          as long as the text
    tag     = HMAC-SHA256(key, "tag" | name | iv | sealed text)       a changed file or a wrong key is noticed
    commitment = SHA-256(salt | text), salt = HMAC-SHA256(key, "salt" | name)[:16], stored inside: who has published the commitment
              cannot seal another answer later

It guards against answers that leak by accident into a diagnosis, and against answers adjusted after the event; the key lies in a file of
its own. Standard library only: no cipher library is a dependency. Text is UTF-8 JSON, compressed.
"""

import hashlib
import hmac
import json
import os
import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from nnhydro.errors import ConfigError, require
from nnhydro.runtime.files import json_text, read_json, write_text

SCHEMA = "nnhydro/sealed/1"
KEY_FILE = "key.txt"
KEY_BYTES = 32
LARGEST = 200_000_000  # bytes of an answer; a longer one was not made here


@final
@dataclass(frozen=True)
class SealedAnswer:
    """An answer as it lies in the suite."""

    name: str
    iv: bytes
    text: bytes
    tag: bytes
    commitment: str

    def document(self) -> dict[str, str]:
        """Return what the .sealed file holds."""
        return {"schema": SCHEMA, "name": self.name, "iv": self.iv.hex(), "tag": self.tag.hex(), "commitment": self.commitment,
                "text": self.text.hex()}


def new_key() -> bytes:
    """Return a key from the operating system's randomness."""
    return os.urandom(KEY_BYTES)


def write_key(path: Path, key: bytes) -> None:
    """Write `key` to `path`, readable by its owner alone."""
    write_text(path, key.hex() + "\n", mode=0o600)


def read_key(path: Path) -> bytes:
    """Return the key in the file `path`; raise ConfigError where it holds none."""
    require(path.is_file(), f"{path}: no key there: give the file that `nnhydro conceal` wrote with --key FILE")
    text = path.read_bytes()[:1000].decode("utf-8", "replace").strip()
    require(re.fullmatch(rf"[0-9a-f]{{{2 * KEY_BYTES}}}", text) is not None,
            f"{path}: holds no key of {2 * KEY_BYTES} hexadecimal digits: give the file that `nnhydro conceal` wrote")
    return bytes.fromhex(text)


def _mac(key: bytes, purpose: str, *parts: bytes) -> bytes:
    framed = b"".join(len(part).to_bytes(8, "big") + part for part in (purpose.encode(), *parts))
    return hmac.new(key, framed, hashlib.sha256).digest()


def _mix(key: bytes, iv: bytes, text: bytes) -> bytes:
    stream = hashlib.shake_256(b"stream" + key + iv).digest(len(text))
    return (int.from_bytes(text, "big") ^ int.from_bytes(stream, "big")).to_bytes(len(text), "big")


def _commitment(salt: bytes, plain: bytes) -> str:
    return hashlib.sha256(salt + plain).hexdigest()


def seal(name: str, answer: dict[str, Any], key: bytes) -> SealedAnswer:
    """Return `answer` sealed under `key` for the campaign `name`."""
    plain = json_text(answer).encode()
    salt = _mac(key, "salt", name.encode())[:16]
    inside = zlib.compress(salt + plain, 9)
    iv = _mac(key, "iv", name.encode(), inside)[:16]
    text = _mix(key, iv, inside)
    return SealedAnswer(name, iv, text, _mac(key, "tag", name.encode(), iv, text), _commitment(salt, plain))


def write_sealed(path: Path, sealed: SealedAnswer) -> None:
    """Write the .sealed file."""
    write_text(path, json_text(sealed.document()))


def _parse(path: Path) -> SealedAnswer:
    """A sealed answer as read; raises ConfigError where it is none."""
    try:
        raw = read_json(path, ConfigError)
        require(raw["schema"] == SCHEMA, f"{path}: schema is {raw['schema']!r}, expected {SCHEMA!r}: made by another version?")
        iv, text, tag = (bytes.fromhex(raw[k]) for k in ("iv", "text", "tag"))
        return SealedAnswer(str(raw["name"]), iv, text, tag, str(raw["commitment"]))
    except (ValueError, KeyError, TypeError) as cause:
        raise ConfigError(f"{path}: is not a sealed answer ({type(cause).__name__}): make the suite again with nnhydro conceal") from cause


def open_sealed(path: Path, key: bytes, commitment: str | None = None) -> dict[str, Any]:
    """Return the answer in `path`; raise ConfigError where the key is wrong or the file was changed since it was sealed."""
    sealed = _parse(path)
    require(hmac.compare_digest(sealed.tag, _mac(key, "tag", sealed.name.encode("utf-8", "replace"), sealed.iv, sealed.text)),
            f"{path}: cannot be opened: this is not its key, or the file was changed since it was sealed")
    require(sealed.name == path.stem, f"{path}: was sealed for {sealed.name}: the answers have been exchanged")
    unpacked = zlib.decompressobj()
    inside = unpacked.decompress(_mix(key, sealed.iv, sealed.text), LARGEST)
    salt, plain = inside[:16], inside[16:]
    found = _commitment(salt, plain)
    require(found == sealed.commitment and commitment in (None, found),
            f"{path}: is another answer than the suite committed itself to: it was sealed again afterwards")
    answer: dict[str, Any] = json.loads(plain)
    return answer
