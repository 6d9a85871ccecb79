"""What maps take in memory while registering, what that costs in time, and what loading them takes.

usage: scripts/results memory --map MAP.ttsdf --scans LIST [--against FOLDER [--against-map MAP.ttsdf]] [--rounds N]
                              [--place NAME MAP.ttsdf LIST]... [--hostile FOLDER] [--page FOLDER]

  --map MAP.ttsdf, --scans LIST  a room and scans as scripts/frames_to_batch makes them: the table of bounds
  --against FOLDER               programs of another build for that table, --against-map its map, where it does not read this one
  --rounds N                     of that table (default 3)
  --place NAME MAP.ttsdf LIST    another map at some bounds, and its scans with priors
  --down NAME X,Y,Z              this place also without priors: down in the sensor frame of its scans
  --hostile FOLDER               files that are broken on purpose: what the tools say of them, in what time and memory
  --page FOLDER                  where memory.md goes (default: BUILD/evaluation/page)

The node is a page of its own (scripts/results node). Where maps and scans of a page may come from:

  objects    ttsdf_simulate --mesh FILE --size 1 --views 25 --sensor kinect --output DIR
             ttsdf_build --mesh DIR/mesh.ply --voxel-size 0.01 --truncation 0.03 --output MAP.ttsdf
  building   building_benchmark --max-rank 40 --refine-iterations 4 --output MAP.ttsdf (scripts/build --benchmarks)
             ttsdf_simulate --scene building --frames 50 --sensor kinect --output DIR
  apartment  ttsdf_simulate --frames 1000 --sensor kinect --output DIR
             ttsdf_build --frames DIR --every 10 --voxel-size 0.03 --truncation 0.09 --max-rank 60 --output MAP.ttsdf
  scans      scripts/frames_to_batch DIR OUT --move 0.1 --turn 0.05 (building: --move 0.2; of every tenth frame of the kitchen,
             every eighth of the apartment: --every 10 --offset 5, --every 8 --offset 5)
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from . import facts, memory_bounds
from .evaluate import parts_failed
from .memory_bounds import registered
from .store import tools_folder
from .text import markdown, percent, size

PLACE_BOUNDS = (0, 4, 15, 200)  # MB; the last is enough to hold a building of 200 million voxels whole
PATIENCE = 60.0                 # seconds for one hostile file


def megabytes(count):
    return f"{count / 1e6:.2f}"


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def compared_as(file_bytes):
    """The map of the comparison (README.json) that has as many bytes."""
    page = facts.read("README")
    found = [f"{name}, rank {key[1:]}" for name, figures in (page["figures"] if page else {}).items()
             for key in ("r40", "r60") if figures["maps"].get(key, {}).get("file_bytes") == file_bytes]
    return found[0] if found else "not there"


def maps_section(a, tools):
    """Which map is which; the comparison has others of the same names."""
    rows, seen = [], set()
    for name, tt_map, _ in [("the room of the first table", a.map, a.scans), *a.place]:
        if os.path.realpath(tt_map) in seen:
            continue
        seen.add(os.path.realpath(tt_map))
        info = json.loads(subprocess.run([str(tools / "ttsdf_info"), tt_map, "--json"], stdout=subprocess.PIPE,
                                         universal_newlines=True, check=True).stdout)
        rows.append([name, " x ".join(map(str, info["dims"])), f"{100 * info['voxel_size']:g} cm", max(info["ranks"]),
                     size(info["file_bytes"]), compared_as(info["file_bytes"])])
    return ("## Which map is which\n\nMaps of the same name in the [comparison](README.md), and so in README's tables, are others "
            "unless the last column names them.\n\n" +
            markdown(["map", "voxels", "voxel size", "rank", "file", "in the comparison"], rows))


def bounds_section(a, tools, folder):
    table = memory_bounds.table(tools, folder, a)
    head = ["`memory_megabytes`", "map [MB]", "process grows by [MB]", "cores", "columns", "bricks", "far field", "mask",
            "loading [s]", "first scan, warm [ms]", "ratio", "median, 99 % [ms]", "success", "median error [mm]"]
    rows = []
    for name, row in table.items():
        sizes = [megabytes(row[key]) if key in row else "-" for key in (
            "map_memory_bytes", "data_added_bytes", "cores_bytes", "columns_bytes", "bricks_bytes", "far_field_bytes",
            "mask_bytes")]
        rows.append([name, *sizes, f"{row['load_seconds']:.3f}" if "load_seconds" in row else "-",
                     f"{row['first_ms']:.2f}, {row['warm_ms']:.2f}", f"{row['first_per_warm']:.1f}",
                     f"{row['median_ms']:.2f}, {row['p99_ms']:.2f}", percent(row["success"]) + " %",
                     f"{1e3 * row['median_error']:.2f}"])
    text = ("## One room at several bounds\n\nMap: all parts added up. Growth of the process: by the system's count, without "
            "library code that is read on the way. First scan: one that the process has not seen, after loading; warm: the "
            "same one again. `other build`: another commit with its own defaults.\n\n" + markdown(head, rows))
    return text, table


def reasons(rows):
    found = {}
    for row in rows:
        if row["success"] != "1":
            found[row["reason"]] = found.get(row["reason"], 0) + 1
    return ", ".join(f"{count} {reason}" for reason, count in sorted(found.items())) or "-"


def scans_of(rows):
    """[success, errors, time] of a run as the table has them."""
    good = [row for row in rows if row["success"] == "1"]
    errors = [float(row["translation_error"]) for row in good if row["translation_error"]]
    times = [float(row["ms"]) for row in rows]
    return [f"{len(good)} of {len(rows)}", reasons(rows),
            f"{1e3 * quantile(errors, 0.5):.1f}, {1e3 * max(errors):.0f}" if errors else "-",
            f"{quantile(times, 0.5):.2f}, {quantile(times, 0.99):.2f}"]


def place_rows(tools, folder, name, tt_map, scans):
    rows, figures = [], []
    for bound in PLACE_BOUNDS:
        words = ["--map", tt_map, "--batch", scans, "--memory-megabytes", bound]
        cold, report = registered(tools, folder, *words)
        again, _ = registered(tools, folder, *words, "--repeat", 7)
        rows.append([name, f"{os.path.getsize(tt_map) / 1e3:.1f} kB", bound, megabytes(report["map_memory_bytes"]),
                     megabytes(report["data_added_bytes"]), f"{report['load_seconds']:.2f}", *scans_of(cold), scans_of(again)[3]])
        figures.append({"bound": bound, "success": rows[-1][6], **report})
        if report["map_memory_bytes"] < 0.75e6 * bound:
            break  # a larger bound changes nothing
    return rows, figures


def places_section(a, tools, folder):
    rows, figures = [], {}
    for name, tt_map, scans in a.place:
        found, figures[name] = place_rows(tools, folder, name, tt_map, scans)
        rows += found
    text = ("## Other places\n\nThe least bound (0), the default (4) and larger ones. Scans far apart: each meets a part of the "
            "map that none before has asked for; again: the median of the same scan seven times, as along a drive.\n\n" +
            markdown(["place", "file", "bound [MB]", "map [MB]", "process grows by [MB]", "loading [s]", "success",
                      "others", "error: median, largest [mm]", "median, 99 % [ms]", "again [ms]"], rows))
    rows = []
    for name, down in a.down:
        _, tt_map, scans = next(place for place in a.place if place[0] == name)
        found, _ = registered(tools, folder, "--map", tt_map, "--batch", scans, "--mode", "global", f"--gravity={down}")
        near = sum(float(row["translation_error"]) < 0.05 for row in found)
        rows.append([name, *scans_of(found), f"{near} of {len(found)}"])
        figures[name + ", without priors"] = rows[-1]
    if rows:
        text += "\n\nWithout priors, gravity known (`--mode global --gravity`), at the default bound:\n\n" + markdown(
            ["place", "accepted", "others", "error of the accepted: median, largest [mm]", "median, 99 % [ms]",
             "within 5 cm, accepted or not"], rows)
    return text, figures


def one_scan(file, scans):
    """The first line of a list as a list of its own."""
    line = next(line.split() for line in pathlib.Path(scans).read_text().splitlines() if line.strip())
    beside = pathlib.Path(scans).resolve().parent
    file.write_text(" ".join(word if word == "-" else str(beside / word) for word in line) + "\n")
    return file


def command_for(tools, file, a, folder):
    """The command that reads a hostile file, or None."""
    room, scans = os.path.abspath(a.map), os.path.abspath(a.scans)
    register_with = [tools / "ttsdf_register", "--output", folder / "out.csv"]
    build = [tools / "ttsdf_build", "--output", folder / "out.ttsdf"]
    if file.suffix == ".ttsdf":
        return [*register_with, "--map", file, "--batch", one_scan(folder / "one.txt", scans)]
    if file.suffix == ".vdb":
        return [*build, "--vdb", file]
    if file.suffix in (".obj", ".off") or (file.suffix == ".ply" and b"face" in file.read_bytes()[:2000]):
        return [*build, "--mesh", file]
    if file.suffix in (".ply", ".pcd"):
        rest = one_scan(folder / "one.txt", scans).read_text().split(" ", 1)[1]
        (folder / "one.txt").write_text(f"{file} {rest}")
        return [*register_with, "--map", room, "--batch", folder / "one.txt"]
    if file.suffix == ".yaml":
        return [*register_with, "--map", room, "--batch", one_scan(folder / "one.txt", scans), "--config", file]
    if file.suffix == ".png":
        frames = folder / "frames"
        frames.mkdir(exist_ok=True)
        shutil.copy(file, frames / "frame-000000.depth.png")
        (frames / "frame-000000.pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        (frames / "camera-intrinsics.txt").write_text("525 0 320\n0 525 240\n0 0 1\n")
        return [*build, "--frames", frames]
    if file.is_dir():
        return [*build, "--frames", file]
    return None


def timed(command, folder):
    """(seconds, peak of resident memory [bytes], exit code or 'no end', last line of what it said)."""
    with open(folder / "said.txt", "w+") as said:
        begin = time.monotonic()
        process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=said, cwd=folder)
        ended, status, usage = 0, 0, None
        while not ended and time.monotonic() - begin < PATIENCE:
            ended, status, usage = os.wait4(process.pid, os.WNOHANG)
            if not ended:
                time.sleep(0.002)
        seconds = time.monotonic() - begin
        if not ended:
            process.kill()
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = status
        said.seek(0)
        lines = [line for line in said.read().replace("\r", "\n").splitlines() if line.strip()]
    code = "no end" if not ended else f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
    return seconds, usage.ru_maxrss * 1024, code, lines[-1] if lines else ""


def hostile_section(a, tools, folder):
    rows, figures = [], {}
    idle = timed([tools / "ttsdf_register", "--help"], folder)[1]
    for file in sorted(pathlib.Path(a.hostile).iterdir()):
        command = command_for(tools, file.resolve(), a, folder)
        if not command:
            continue
        seconds, peak, code, said = timed(command, folder)
        said = said.replace(str(file.resolve()), file.name).split("error: ")[-1].replace("|", "/")
        figures[file.name] = {"seconds": seconds, "peak_bytes": peak, "code": code}
        rows.append([file.name, pathlib.Path(command[0]).name, f"{seconds:.2f}", f"{peak / 1e6:.0f}", code,
                     said if len(said) < 120 else said[:117] + "..."])
    return (f"## Hostile files\n\nEach read by a tool in a process of its own; one that only prints its help takes {idle / 1e6:.0f} MB. "
            "Exit code 1: refused; 0: read.\n\n" +
            markdown(["file", "tool", "seconds", "peak of resident memory [MB]", "exit code", "last line"], rows)), figures


def parse(arguments):
    parser = argparse.ArgumentParser(prog="results memory", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("--map", "--scans"):
        parser.add_argument(name, required=True, help=argparse.SUPPRESS)
    for name in ("--against", "--against-map", "--hostile"):
        parser.add_argument(name, help=argparse.SUPPRESS)
    parser.add_argument("--rounds", type=int, default=3, help=argparse.SUPPRESS)
    parser.add_argument("--place", nargs=3, action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--down", nargs=2, action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--page", type=pathlib.Path, help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    unknown = [name for name, _ in a.down if name not in [place[0] for place in a.place]]
    if unknown:
        parser.error(f"--down: got '{unknown[0]}', wanted the name of a --place")
    return a


@parts_failed("memory")
def main(arguments):
    a = parse(arguments)
    build, tools = tools_folder("ttsdf_register", "ttsdf_build", "ttsdf_info")
    parts, figures = [maps_section(a, tools)], {}
    with tempfile.TemporaryDirectory(prefix="ttsdf_memory_") as folder:
        folder = pathlib.Path(folder)
        text, figures["bounds"] = bounds_section(a, tools, folder)
        parts.append(text)
        if a.place:
            text, figures["places"] = places_section(a, tools, folder)
            parts.append(text)
        if a.hostile:
            text, figures["hostile"] = hostile_section(a, tools, folder)
            parts.append(text)
    shown = " ".join(os.path.relpath(word, pathlib.Path(word).parent.parent) if os.path.exists(word) else
                     f"'{word}'" if " " in word else word for word in arguments)
    run_facts = facts.of_run("scripts/results memory " + shown, ("register",))
    print("\n\n".join(parts), file=sys.stderr)
    print(facts.write(a.page or build / "evaluation" / "page", "memory",
                      "\n\n".join(["# Maps in memory", facts.sentence(run_facts), *parts]), run_facts, figures))
    return 0
