"""usage: map_reader_check.py FOLDER: every X.ttsdf must read as X.expected says, every X.refused must not read."""

import pathlib
import sys

import numpy as np

import map_reader
from map_bytes import FormatError

NUMBERS = ("dims", "voxel_size", "ranks", "truncation", "clamp_negative", "clamp_positive", "cell_voxels")


def problems_of(path):
    found = map_reader.read_map(path.read_bytes())
    samples, metadata = [], {}
    for line in path.with_suffix(".expected").read_text(encoding="utf-8").splitlines():
        key, _, text = line.partition(" ")
        if key == "sample":
            samples.append([float(word) for word in text.split()])
        elif key == "metadata":
            name, _, metadata[name] = text.partition("=")
        elif key == "agreement":
            wanted = [float(word) for word in text.split()]
            if wanted[0] == 0:
                wanted = None
            if found[key] != wanted:
                yield "agreement: got %s, wanted %s" % (found[key], text)
        elif key == "viewpoints":
            if [float(word) for word in text.split()] != (found[key] or []):
                yield "viewpoints: got %s, wanted %s" % (found[key], text)
        elif key in NUMBERS:
            if [float(word) for word in text.split()] != np.ravel(found[key]).tolist():
                yield "%s: got %s, wanted %s" % (key, found[key], text)
        elif found[key] != text:
            yield "%s: got %s, wanted %s" % (key, found[key], text)
    if found["metadata"] != metadata:
        yield "metadata: got %s, wanted %s" % (found["metadata"], metadata)
    samples = np.array(samples)
    indices = samples[:, :3].astype(int)
    # Cores are floats: seven digits of the largest terms that are summed up.
    if np.abs(map_reader.sample(found, indices) - samples[:, 6]).max() > 2e-6:
        yield "values differ"
    if np.abs(map_reader.position(found, indices) - samples[:, 3:6]).max() > 1e-9:
        yield "positions differ"
    if (map_reader.supported(found, indices) != (samples[:, 7] > 0)).any():
        yield "support differs"


def main(folder):
    problems, files = [], 0
    for path in sorted(folder.iterdir()):
        files += 1
        if path.suffix == ".ttsdf":
            problems += ["%s: %s" % (path.name, problem) for problem in problems_of(path)]
        elif path.suffix == ".refused":
            try:
                map_reader.read_map(path.read_bytes())
                problems.append("%s: accepted" % path.name)
            except FormatError:
                pass
    print("\n".join(problems) or "map_reader.py agrees on %d files" % files)
    return 1 if problems or not files else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
