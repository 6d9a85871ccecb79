"""Writes the figures of doc/results into README.md, between its marks `<!-- figures -->` and `<!-- end of figures -->`.

usage: scripts/results readme [--check]

  --check   writes nothing; exit code 1 if README.md has other figures than doc/results
"""

import argparse
import sys

from . import comparison_page, facts
from .store import ROOT
from .text import bold, markdown, percent, size

BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"
SHOWN = (("ours_r40", "**this package**, rank 40"), ("ours_r60", "this package, rank 60"), ("GICP", "GICP (PCL), cloud of 5 cm"),
         ("GICP_small", "GICP, cloud in the bytes of our map (Draco)"), ("ICP_plane", "point-to-plane ICP (Open3D)"),
         ("TT-SDF", "the paper's TT-SDF, rank 70"))
SCENES = (("redkitchen", "red kitchen (Kinect; poses good to 24 mm)"), ("apartment", "simulated flat (exact poses)"))
REACH = (("translation", 0.1), ("translation", 0.5), ("translation", 1.0), ("rotation", 0.25))


def success_at(row, key):
    return next((s for kind, magnitude, s in row["success"] if (kind, magnitude) == key), float("nan"))


def table(name, title, figures):
    methods = comparison_page.parts_of(figures)
    rows = []
    for method, label in SHOWN:
        if method not in methods:
            continue
        row, mark = methods[method], method == "ours_r40"
        file = comparison_page.file_bytes(method, figures)
        if file == "-":
            file = size(row.get("paper_bytes")) + " (12 bytes a point)"
        cells = [file, size(row.get("memory_bytes")), " / ".join(percent(success_at(row, key)) for key in REACH) + " %",
                 percent(row["all"]["accepted_wrong"], 1) + " %", comparison_page.pair(row["all"]) + " mm / mrad",
                 f"{row['all']['milliseconds']:.3g} ms"]
        rows.append([label, *(bold(cell, mark) for cell in cells)])
    head = [title, "map", "in memory", "success from 0.1 / 0.5 / 1 m, 0.25 rad", "accepted and wrong", "median of successes",
            "per scan"]
    return markdown(head, rows)


def text_of(page):
    scenes = page["figures"]
    parts = [table(name, title, scenes[name]) for name, title in SCENES if name in scenes]
    counts = " and ".join(str(scenes[name]["scans"]) for name, _ in SCENES if name in scenes)
    parts.append(f"{counts} scans that are not in the map, five "
                 "directions per magnitude, all of the paper's magnitudes; success: within 5 cm; one thread. "
                 f"Commit {page['commit']}, {page['machine']}. All scenes, all methods and the command: "
                 "[results](doc/results/README.md). Where others are ahead: "
                 "[what this is not better at](doc/results/limits.md).")
    if (facts.RESULTS / "map_slice.png").exists():
        parts.append("![A slice of the compressed map beside the uncompressed field](doc/results/map_slice.png)")
    return "\n\n".join(parts)


def replaced(readme, text):
    before, _, rest = readme.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + "\n" + text + "\n" + END + after


def main(arguments):
    parser = argparse.ArgumentParser(prog="results readme", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    check = parser.parse_args(arguments).check
    page = facts.read("README")
    if page is None and check:
        return 0  # nothing was measured, nothing can disagree
    if page is None:
        sys.exit("readme: error: got no doc/results/README.json, wanted scripts/evaluate --page doc/results before")
    path = ROOT / "README.md"
    readme = path.read_text()
    if BEGIN not in readme:
        sys.exit(f"readme: error: got no mark {BEGIN} in README.md")
    wanted = replaced(readme, text_of(page))
    if check and wanted != readme:
        sys.exit("readme: error: got other figures in README.md than in doc/results: run scripts/results readme")
    if not check:
        path.write_text(wanted)
    return 0
