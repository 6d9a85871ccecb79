"""Which sources decide which figures, and a digest of them that comments and line breaks do not change."""

import functools
import hashlib
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

COMMON = ("tensor", "geometry", "options")
MAP = (*COMMON, "field", "map")
PARTS = {
    "frames": (*COMMON, "frames"),
    "simulate": (*COMMON, "simulation"),
    "build": (*MAP, "frames", "fusion", "surface", "signed_field", "mesh", "build_steps", "compression", "mapping"),
    "register": (*MAP, "registration"),
    "localize": (*MAP, "registration", "localization"),
    "paper": (*MAP, "frames", "evaluation"),
    "sweep": ("evaluation",),  # methods of others do not depend on our code; tests pin how frames are read
}
ENDINGS = (".cpp", ".h")
# Strings first: a comment's marks within them start none.
TOKEN = re.compile(r'("(?:\\.|[^"\\\n])*")|(//[^\n]*|/\*.*?\*/)|(\s+)', re.DOTALL)


def essence(text):
    """Source text without comments, line breaks and indentation: what re-formatting and re-wording leave alone."""
    return TOKEN.sub(lambda m: m.group(1) or " ", text).strip()


def essence_words(text):
    return re.sub(r"\s+", " ", essence(text))


@functools.lru_cache(maxsize=None)
def folder_digest(folder, root=ROOT):
    result = hashlib.sha256()
    for base in (root / "src" / folder, root / "include" / "ttsdf_localization" / folder):
        for file in sorted(p for p in base.rglob("*") if p.suffix in ENDINGS):
            result.update(essence_words(file.read_text()).encode() + b"\0")
    return result.hexdigest()


def folders(parts):
    return sorted({folder for part in parts for folder in PARTS[part]})


def digest(parts):
    """Of the sources of these parts."""
    text = "".join(folder + folder_digest(folder) for folder in folders(parts))
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def newest_source(parts):
    """(time of the last change, file)."""
    files = [file for folder in folders(parts) for base in ("src", "include/ttsdf_localization")
             for file in (ROOT / base / folder).rglob("*") if file.suffix in ENDINGS]
    return max((file.stat().st_mtime, str(file.relative_to(ROOT))) for file in files)
