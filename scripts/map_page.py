"""The page of scripts/map_results: tables, verdicts on the bars, pictures."""

import csv
import datetime
import os
import pathlib
import statistics

import evaluation_data
import map_plots

SUCCESS_FROM, ERROR_FROM = 0.5, 0.1  # magnitudes [m] that success and median errors are read at
PAPER_BYTES, CLOUD_BYTES = 3.1e6, 320e3  # the paper's map and sparse cloud of the same room


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def kilobytes(count):
    return f"{count / 1e3:.1f} kB" if count < 1e6 else f"{count / 1e6:.2f} MB"


class Bar:
    """A figure and what was asked for."""

    def __init__(self, what, wanted, got, met):
        self.row = [what, wanted, got, "met" if met else "**missed**"]


class Results:
    def __init__(self, commit, quick):
        self.commit, self.quick = commit, quick
        self.maps, self.sizes, self.accuracy, self.benchmarks, self.building = [], [], [], {}, ""

    def read_track(self, log, memory):
        rows = evaluation_data.read_log(log)
        with open(memory) as file:
            in_memory = {row["method"]: int(row["memory_bytes"]) for row in csv.DictReader(file)}
        for m in self.maps:
            mine = [row for row in rows if row["method"] == m["name"]]
            far = [row for row in mine if row["magnitude"] == SUCCESS_FROM]
            near = [row for row in mine if row["magnitude"] == ERROR_FROM]
            m["scans"] = len({row["scan"] for row in mine})
            m["success"] = sum(r["translation_error"] < evaluation_data.SUCCESS_DISTANCE for r in far) / len(far)
            m["translation"] = statistics.median(r["translation_error"] for r in near)
            m["rotation"] = statistics.median(r["rotation_error"] for r in near)
            m["localizer_bytes"] = in_memory[m["name"]]

    # ours, without the paper's
    def ours(self):
        return [m for m in self.maps if not m["name"].startswith("paper")]

    def within(self, limit):
        """The largest of our maps within a size that is as good as any map (5 %), or the best one there."""
        small = [m for m in self.ours() if m["file_bytes"] <= limit]
        return min(small, key=lambda m: (m["success"] < 0.95 * self.best("success", max), m["translation"]))

    def best(self, figure, choose):
        return choose(m[figure] for m in self.ours())

    def size_bars(self):
        bars = []
        best_success, best_error = self.best("success", max), self.best("translation", min)
        for limit in (160e3, 100e3):
            if not any(m["file_bytes"] <= limit for m in self.ours()):
                continue
            m = self.within(limit)
            good = m["success"] >= 0.95 * best_success and m["translation"] <= 1.05 * best_error
            bars.append(Bar(f"<= {limit / 1e3:.0f} kB: success and median error within 5 % of the best of all maps",
                            f">= {95 * best_success:.1f} %, <= {1050 * best_error:.1f} mm",
                            f"{m['name']}, {kilobytes(m['file_bytes'])}: {100 * m['success']:.1f} %, "
                            f"{1e3 * m['translation']:.1f} mm", good))
        small = [m for m in self.ours() if m["file_bytes"] <= 160e3]
        if small:
            exact = min(small, key=lambda m: m["surface_rms"])
            bars.append(Bar("<= 160 kB: rms error within 3 cm of the surface", "<= 8 mm",
                            f"{exact['name']}, {kilobytes(exact['file_bytes'])}: {1e3 * exact['surface_rms']:.1f} mm",
                            exact["surface_rms"] <= 0.008))
        return bars

    def maps_section(self):
        rows = []
        for m in sorted(self.maps, key=lambda m: -m["file_bytes"]):
            rows.append([m["name"], f"{m['rank1']}, {m['rank2']}", m["encoding"], f"{m['file_bytes']}",
                         f"{1e3 * m['surface_rms']:.1f} mm", f"{100 * m['success']:.1f} %",
                         f"{1e3 * m['translation']:.1f} mm, {1e3 * m['rotation']:.1f} mrad",
                         kilobytes(m["localizer_bytes"])])
        rows.append(["*the paper's, as printed*", "70", "float32", f"{PAPER_BYTES:.0f}", "", "", "", ""])
        rows.append(["*sparse point cloud, 5 cm, as printed in the paper*", "", "", f"{CLOUD_BYTES:.0f}", "", "", "", ""])
        head = ["map", "ranks", "encoding", "file [byte]", "rms within 3 cm of the surface",
                f"success from {SUCCESS_FROM} m", f"median from {ERROR_FROM} m", "memory in the localizer"]
        return (f"## Ranks and encodings\n\nEvery 10th frame at 2 cm; `track` on {self.maps[0]['scans']} scans outside the "
                "map, 5 directions per magnitude; success: within 5 cm. The rms compares the stored map with the uncompressed "
                "field. *Memory*: with decoded bricks, search structures and the far field. `target-N` chose its ranks for N "
                "bytes; `paper-R70` is the paper's setting (occupancy transform, plain TT-SVD), evaluated as the paper does, "
                "its rms against its own uncompressed field.\n\n" + table(head, rows)
                + "\n\n![sizes and errors](map_sizes.png)\n\n![the map of rank 40](map_slices.png)\n")

    def accuracy_rows(self):
        """Lines of field_accuracy: scene, observation, voxels, rms, median, signs, wrong signs far from the surface."""
        rows = []
        for scene, text in zip(("room",), self.accuracy):
            for line in text.splitlines()[1:]:
                words = line.split()
                rows.append([scene, " ".join(words[:-5])] + words[-5:])
        return rows

    def accuracy_section(self):
        return ("## The uncompressed field against exact distances\n\nSimulated, without noise. *Every voxel*: what perfect "
                "observation would leave (band on both sides of a surface, free before it, unknown behind it). *Depth frames*: "
                "rendered along the camera's way, 640 x 480, fused with carving. Signs: of the samples that a ray passed on its way "
                "to a reading, away from the surface by more than 0.05 voxel. Errors: of the samples within 1.5 voxels of a "
                "surface that a ray ended on, no flatter than 80 degrees. Left out is what the scene does not know: samples whose "
                "nearest surface is an outer face of the world, and samples inside matter whose nearest surface is covered by "
                "another solid (furniture on the floor).\n\n"
                + table(["world", "observation", "voxels seen", "rms [voxel]", "median [voxel]", "right signs [%]",
                         "wrong beyond half a voxel [%]"], self.accuracy_rows()) + "\n")

    def accuracy_bars(self):
        bars = []
        for scene, observation, _, rms, _, signs, _ in self.accuracy_rows():
            bars.append(Bar(f"field error near the surface, {scene}, {observation}", "<= 0.05 voxel", f"{rms} voxel",
                            float(rms) <= 0.05))
            bars.append(Bar(f"signs, {scene}, {observation}", "100 % right", f"{float(signs):.3f} %", float(signs) >= 100.0))
        return bars

    def milliseconds(self, name, time="real_time"):
        figure = self.benchmarks[name]
        return figure[time] * {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}[figure["time_unit"]]

    def speed_bars(self):
        frames = self.benchmarks["fuseFrame/threads:2/real_time"]["items_per_second"]
        svd = self.milliseconds("ttSvdOfTheArray/rank:40", "cpu_time")
        map40 = next(m for m in self.maps if m["name"] == "R40-quantized")
        fusing = map40["frames"] / map40["seconds"]["read_and_fuse"]
        bars = [Bar("fusion of one simulated 640 x 480 frame at 2 cm with carving, again and again", ">= 10 frames/s",
                    f"{frames:.1f} frames/s", frames >= 10),
                Bar("fusion of the kitchen's frames, reading included", ">= 10 frames/s", f"{fusing:.1f} frames/s", fusing >= 10),
                Bar(f"kitchen, {map40['frames']} frames to file", "<= 25 s",
                    f"{map40['wall']:.1f} s ({map40['cpu']:.1f} s of processor time)", map40["wall"] <= 25),
                Bar("TT-SVD of 346 x 152 x 153, rank 40, one core", "<= 0.5 s", f"{svd / 1e3:.2f} s", svd <= 500)]
        for line in self.building.splitlines():
            if line.startswith("sparse volume to map file"):
                wall, cpu, peak = map(float, line.split()[-3:])
                bars.append(Bar("building of over 200 million voxels, sparse volume to file", "<= 60 s, <= 1200 MB",
                                f"{wall:.0f} s ({cpu:.0f} s of processor time), {peak:.0f} MB", wall <= 60 and peak <= 1200))
        return bars

    def growth_section(self):
        text = ("## Growth with size and rank\n\n![growth](map_growth.png)\n\nTT-SVD of cubes: the Gram matrices ask for n^4 "
                "operations. Evaluation: the first scan contracts the columns it needs, later ones look them up, whatever the "
                "rank. The same room at several voxel sizes (rank 40, the band three voxels wide):\n\n")
        head = ["voxel", "dimensions", "dense", "file", "map in memory", "sampling", "decomposition", "encoding"]
        rows = [[f"{1e3 * m['voxel']:.0f} mm", " x ".join(map(str, m["dims"])), kilobytes(m["dense_bytes"]),
                 kilobytes(m["file_bytes"]), kilobytes(m["memory_bytes"])]
                + [f"{m['seconds'][step]:.2f} s" for step in ("distance_field", "decompose", "encode")] for m in self.sizes]
        return text + table(head, rows) + "\n"

    def building_section(self):
        if not self.building:
            return ""
        return ("## A building of over 200 million voxels\n\n`building_benchmark --max-rank 40 --refine-iterations 4`, sampled in "
                f"tiles, kept in bricks, compressed slab by slab:\n\n```text\n{self.building.rstrip()}\n```\n")

    def write(self, folder):
        map_plots.draw_sizes(self.maps, folder / "map_sizes.png")
        map_plots.draw_growth(self, folder / "map_growth.png")
        bars = self.size_bars() + self.accuracy_bars() + self.speed_bars()
        missed = sum("missed" in bar.row[-1] for bar in bars)
        command = "scripts/map_results FRAMES" + (" --quick" if self.quick else "") + (
            " --with-building" if self.building else "")
        text = [f"# The map\n\nMade by `{command}`, commit {self.commit}, {datetime.date.today()}, on {os.cpu_count()} cores; "
                f"load {os.getloadavg()[0]:.1f} at the end (other work on the machine makes wall times longer).\n",
                f"## Bars\n\n{len(bars) - missed} of {len(bars)} are met.\n\n"
                + table(["what", "wanted", "measured", ""], [bar.row for bar in bars]) + "\n",
                self.maps_section(), self.accuracy_section(), self.growth_section(), self.building_section()]
        pathlib.Path(folder / "map.md").write_text("\n".join(part for part in text if part))
