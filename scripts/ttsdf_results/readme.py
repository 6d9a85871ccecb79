"""Writes the figures of doc/results into README.md, between its marks `<!-- figures -->` and `<!-- end of figures -->`, and
doc/results/limits.md, which has figures of several pages.

usage: scripts/results readme [--check]

  --check   writes nothing; exit code 1 if README.md or limits.md has other figures than doc/results
"""

import argparse
import sys

from . import comparison_page, elsewhere, facts
from .scenes import SCENES as ALL_SCENES
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
                 comparison_page.milliseconds(method, row) + " ms"]
        rows.append([label, *(bold(cell, mark) for cell in cells)])
    head = [f"{title}; {figures['scans']} scans", "map", "in memory", "success from 0.1 / 0.5 / 1 m, 0.25 rad", "accepted and wrong",
            "median of successes", "per scan"]
    return markdown(head, rows)


def all_scenes(scenes):
    """How rank 40 does on every scene, within the reach of the results page."""
    ours, ahead, wrong = [], [], []
    for name, figures in scenes.items():
        methods = comparison_page.parts_of(figures)
        mine = methods["ours_r40"]["reach"]
        others = [row["reach"]["success"] for method, row in methods.items() if not method.startswith("ours")]
        ours.append(mine["success"])
        ahead += [name] if others and max(others) > mine["success"] + 1e-9 else []
        if mine["accepted_wrong"] > elsewhere.WRONG:
            wrong.append(f"{name} ({percent(mine['accepted_wrong'], 1)} %, {figures['scans']} scans)")
    return (f"On all {len(scenes)} scenes, up to 0.5 m and 0.25 rad, rank 40 succeeds in {percent(min(ours))} to {percent(max(ours))} %. "
            f"Another method succeeds more often on {', '.join(ahead) or 'none'}; wrong poses are accepted on "
            f"{' and '.join(wrong) or 'none'}. [All scenes, methods and the command](doc/results/README.md); "
            "[what this is not better at](doc/results/limits.md).")


def limits_of(page):
    """limits.md, as an evaluation of these scenes writes it."""
    names = [scene.name for scene in ALL_SCENES if scene.name in page["figures"]]
    return comparison_page.limits_text(page, {name: page["figures"][name] for name in names}).rstrip() + "\n"


def text_of(page):
    scenes = {s.name: page["figures"][s.name] for s in ALL_SCENES if s.name in page["figures"]}
    parts = [table(name, title, scenes[name]) for name, title in SCENES if name in scenes]
    parts.append("One scene each. The scans are not in the map, but the map has a frame 0.17 s away in the same sequence, which makes every "
                 "method look better than on another day ([harder scenes](doc/results/README.md#scans-beside-the-map)). Five "
                 "directions per magnitude, all of the paper's magnitudes; success: within 5 cm; one thread. GICP's and ICP's settings were "
                 f"chosen on the red kitchen; †: of two runs only. Commit {page['commit']}, {page['machine']}.")
    parts.append(all_scenes(scenes))
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
    for file, wanted in ((path, replaced(readme, text_of(page))), (facts.RESULTS / "limits.md", limits_of(page))):
        if check and wanted != file.read_text():
            sys.exit(f"readme: error: got other figures in {file.name} than in doc/results/*.json: run scripts/results readme")
        if not check:
            file.write_text(wanted)
    return 0
