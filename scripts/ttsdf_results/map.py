"""What a map costs and how exact it is, by rank, encoding and target; and the same room in other formats.

usage: scripts/results map [--data FOLDER] [--quick] [--page FOLDER] [--store FOLDER] [--jobs N] [--building PROGRAM]

  --data FOLDER       folder with redkitchen/ (default $TTSDF_TEST_DATA); without it the simulated apartment is mapped
  --quick             a few maps and scans: shows that everything works
  --page FOLDER       where map.md and its pictures go (default: STORE/page)
  --building PROGRAM  building_benchmark of a build with benchmarks: a building of over 200 million voxels (minutes)

The other commands' store is used: what is there for this code is not run again.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys

from . import facts, plots, protocol, scenes
from .evaluate import Runner, parts_failed
from .logs import condense, of_method, perturbation, read_log
from .store import Store, tools_folder
from .text import markdown, millis, percent, size

RANKS, ENCODINGS = (20, 40, 60), ("float32", "float16", "quantized")
TARGETS = (100000, 60000, 30000, 15000)
LARGEST = (120, "float32")  # what smaller maps are held against
VOXELS = (0.08, 0.04, 0.03)  # and the 0.02 of the tables
PAPER_MAP, PAPER_CLOUD = 3.1e6, 320e3  # printed in the paper for the red kitchen
DEFAULT = "R40-quantized"


def map_steps(builder, quick):
    ranks, targets = (RANKS[:2], TARGETS[-1:]) if quick else (RANKS, TARGETS)
    options = {f"R{rank}-{encoding}": ("--max-rank", rank, "--encoding", encoding) for encoding in ENCODINGS for rank in ranks}
    options.update({f"target-{target // 1000}kB": ("--target-bytes", target) for target in targets})
    if not quick:
        options[f"R{LARGEST[0]}-{LARGEST[1]}"] = ("--max-rank", LARGEST[0], "--encoding", LARGEST[1])
    return {name: builder.build(name, *words) for name, words in options.items()}


def voxel_steps(builder, quick):
    return {voxel: builder.build(f"voxel-{1000 * voxel:.0f}mm", "--voxel-size", voxel, "--truncation", round(3 * voxel, 3))
            for voxel in (VOXELS[:1] if quick else VOXELS)}


def read_maps(store, steps, sweep):
    rows = read_log(store.path(sweep) / protocol.LOG)
    memory = protocol.read_memory(store.path(sweep) / protocol.MEMORY)
    maps = []
    for name, step in steps.items():
        report = protocol.read_report(store, step)
        mine = of_method(rows, name)
        near = condense([row for row in mine if perturbation(row) == ("translation", 0.1)])
        far = condense([row for row in mine if perturbation(row) == ("translation", 0.5)])
        maps.append({"name": name, "success": far.success, "translation": near.translation_of_all[1],
                     "rotation": near.rotation_of_all[1], "localizer_bytes": memory[name][1], **report})
    return sorted(maps, key=lambda m: -m["file_bytes"])


def maps_section(maps, scans, others):
    rows = [[m["name"], f"{m['rank1']}, {m['rank2']}", m["encoding"], m["file_bytes"], f"{1e3 * m['surface_rms']:.1f} mm",
             f"{percent(m['success'], 1)} %", f"{millis(m['translation'])} mm, {millis(m['rotation'])} mrad",
             size(m["localizer_bytes"])] for m in maps]
    return "\n\n".join([
        "## Ranks and encodings",
        f"Every 10th frame at 2 cm; tracking on {scans} scans outside the map, 5 directions per magnitude; success: within "
        "5 cm. The rms compares the stored map with the uncompressed field. Memory: what the heap holds for the map after all "
        "scans, measured. `target-N` chose its ranks for N bytes.",
        markdown(["map", "ranks", "encoding", "file [byte]", "rms within 3 cm of the surface", "success from 0.5 m",
                  "median from 0.1 m", "memory"], rows),
        "![sizes and errors](map_sizes.png)",
        "## The same room in other formats", "Files only; what each is good for differs.",
        markdown(["format", "file [byte]", "what it is"], [[name, count, what] for name, count, what in others]),
        "![a slice of the map beside the uncompressed field](map_slice.png)"])


def file_formats(store, builder, folder):
    """(name, bytes, what) of other ways to keep the room."""
    volume = store.path(builder.steps.maps["volume"]) / "volume.vdb"
    rows = [["OpenVDB, as fused", volume.stat().st_size, "truncated distances and weights, 32 bit"]]
    small = folder / "formats"
    small.mkdir(parents=True, exist_ok=True)
    half = small / "half.vdb"
    if run(sys.executable, "-c", HALF, str(volume), str(half)):
        rows.append(["OpenVDB, 16 bit, distances only", half.stat().st_size, "half floats, Blosc or zip as the library writes"])
    default = store.path(builder.steps.maps[DEFAULT]) / protocol.MAP
    mesh = small / "surface.ply"
    export = store.tools / "ttsdf_export"
    if export.exists() and run(str(export), str(default), "--surface", str(mesh)):
        rows.append(["mesh of the map's surface, PLY", mesh.stat().st_size, "triangles, 32 bit"])
        packed = small / "surface.drc"
        if shutil.which("draco_encoder") and run("draco_encoder", "-i", str(mesh), "-o", str(packed), "-qp", "12", "-cl", "10"):
            rows.append(["the same through Draco", packed.stat().st_size, "12 bits a coordinate"])
    cloud = store.path(builder.steps.parts["small"]) if "small" in builder.steps.parts else None
    if cloud and (cloud / "cloud.drc").exists():
        rows.append(["point cloud through Draco", (cloud / "cloud.drc").stat().st_size,
                     (cloud / "finished.txt").read_text().splitlines()[1]])
    rows += [["the paper's map, as printed", int(PAPER_MAP), "by its formula, in memory"],
             ["point cloud of 5 cm, as printed in the paper", int(PAPER_CLOUD), "by its formula, in memory"],
             ["**this map, rank 40**", default.stat().st_size, "signed distances and what is known"]]
    return sorted(rows, key=lambda row: -row[1])


# Keeps the grid of distances only, as half floats. Needs the Debian package python3-openvdb.
HALF = """
import sys
try:
    import pyopenvdb as vdb
except ImportError:
    import openvdb as vdb
grids, _ = vdb.readAll(sys.argv[1])
grid = next(g for g in grids if g.gridClass == "level set" or "tsdf" in g.name.lower() or "dist" in g.name.lower())
grid.saveFloatAsHalf = True
vdb.write(sys.argv[2], grids=[grid])
"""


def run(*command):
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def growth_section(sizes):
    rows = [[f"{1e3 * voxel:.0f} mm", " x ".join(map(str, m["dims"])) if "dims" in m else "", size(m["dense_bytes"]),
             size(m["file_bytes"]), size(m["memory_bytes"]),
             *(f"{m['seconds'][step]:.2f} s" for step in ("distance_field", "decompose", "encode"))] for voxel, m in sizes]
    return "\n\n".join(["## Growth with the voxels", "The same room, rank 40, the band three voxels wide:",
                        markdown(["voxel", "dimensions", "dense", "file", "map in memory", "sampling", "decomposition",
                                  "encoding"], rows)])


def building_section(text):
    return ("## A building of over 200 million voxels\n\n`building_benchmark --max-rank 40 --refine-iterations 4`, sampled in "
            f"tiles, kept in bricks, compressed slab by slab:\n\n```text\n{text.rstrip()}\n```")


def parse(arguments):
    parser = argparse.ArgumentParser(prog="results map", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    parser.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)
    for name in ("--page", "--store"):
        parser.add_argument(name, type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--building", help=argparse.SUPPRESS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


@parts_failed("map")
def main(arguments):
    a = parse(arguments)
    build, tools = tools_folder("ttsdf_evaluate", "ttsdf_build")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    there, _ = scenes.available(a.data, ("redkitchen", "apartment"))
    scene = there[0]
    plan = protocol.Plan(scans=10 if a.quick else 50, directions=1 if a.quick else 5, translations="0.1,0.5", rotations="none")
    builder = protocol.SceneProtocol(scene, a.data or "", plan)
    maps = map_steps(builder, a.quick)
    sizes = voxel_steps(builder, a.quick)
    builder.volume()
    if shutil.which("draco_encoder"):
        builder.small_cloud(maps[DEFAULT], "small")
    full = builder.full()
    sweep = builder.sweep("maps", ("sweep", "register"),
                          [(f"{name}=track:map=", step, "/" + protocol.MAP) for name, step in maps.items()])
    for _ in Runner(store, max(1, a.jobs)).run([protocol.in_order([sweep, *sizes.values(), *builder.steps.parts.values(),
                                                                   *builder.steps.maps.values()])]):
        pass
    folder = a.page or store.folder / "page"
    found = read_maps(store, maps, sweep)
    plots.map_sizes(found, folder / "map_sizes.png")
    plots.map_slice(tools, store.path(maps[DEFAULT]) / protocol.MAP, store.path(full) / protocol.MAP, folder / "map_slice.png")
    growth = [(voxel, protocol.read_report(store, step)) for voxel, step in sizes.items()]
    growth.append((0.02, next(m for m in found if m["name"] == DEFAULT)))
    scans = len({row["scan"] for row in read_log(store.path(sweep) / protocol.LOG)})
    run_facts = facts.of_run("scripts/results map --data DATA" + (" --quick" if a.quick else ""), ("build", "register"))
    parts = ["# The map", facts.sentence(run_facts), f"Scene: {scene.name} ({scene.what}).",
             maps_section(found, scans, file_formats(store, builder, store.folder)), growth_section(growth)]
    if a.building:
        text = subprocess.run([a.building, "--max-rank", "40", "--refine-iterations", "4"], stdout=subprocess.PIPE,
                              universal_newlines=True, check=True).stdout
        parts.append(building_section(text))
    print(facts.write(folder, "map", "\n\n".join(parts), run_facts, {m["name"]: m for m in found}))
    return 0
