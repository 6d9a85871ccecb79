"""Which sources decide which figures, and a digest of them that comments, line breaks and the order of includes do not change."""

import functools
import hashlib
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

COMMON = ("tensor", "geometry", "options")
MAP = (*COMMON, "field", "map")
# Folders of src/ and include/, or files of them without their endings.
PARTS = {
    "frames": (*COMMON, "frames"),
    "simulate": (*COMMON, "sensor", "simulation", "evaluation/synthetic_frames"),
    # "agreement" registers frames against each other: a report that no map's surface depends on.
    "build": (*MAP, "readers", "frames", "fusion", "surface", "signed_field", "mesh", "build_steps", "compression", "mapping",
              "agreement"),
    "register": (*MAP, "registration", "evaluation/field_methods"),
    "localize": (*MAP, "registration", "localization",
                 *(f"ros/{part}" for part in ("messages", "parameters", "poses", "scans", "maps", "node"))),
    "paper": (*MAP, "evaluation/paper_method"),
    # methods of others do not depend on our code; tests pin how frames are read
    "sweep": tuple(f"evaluation/{name}" for name in ("cloud_methods", "open3d_methods", "scan_set", "perturbation", "sweep")),
}
ENDINGS = (".cpp", ".h")
# Strings first: a comment's marks within them start none.
TOKEN = re.compile(r'("(?:\\.|[^"\\\n])*")|(//[^\n]*|/\*.*?\*/)|(\s+)', re.DOTALL)
INCLUDE = re.compile(r"^[ \t]*#[ \t]*include\b.*$", re.MULTILINE)


def essence(text):
    """Source text without includes, comments, line breaks and indentation: what re-formatting and moving files leave alone."""
    text = INCLUDE.sub("", text)
    return TOKEN.sub(lambda m: m.group(1) or " ", text).strip()


def essence_words(text):
    return re.sub(r"\s+", " ", essence(text))


def files_of(entry, root=ROOT):
    for base in (root / "src" / entry, root / "include" / "ttsdf_localization" / entry):
        found = base.rglob("*") if base.is_dir() else base.parent.glob(base.name + ".*")
        yield from sorted(file for file in found if file.suffix in ENDINGS)


@functools.lru_cache(maxsize=None)
def folder_digest(folder, root=ROOT):
    result = hashlib.sha256()
    for file in files_of(folder, root):
        result.update(essence_words(file.read_text()).encode() + b"\0")
    return result.hexdigest()


def folders(parts):
    return sorted({folder for part in parts for folder in PARTS[part]})


def digest(parts):
    """Of the sources of these parts."""
    text = "".join(folder + folder_digest(folder) for folder in folders(parts))
    return hashlib.sha256(text.encode()).hexdigest()[:12]
