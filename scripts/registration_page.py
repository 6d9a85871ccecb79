"""The registration page: what was promised, what was measured, and which promises are missed."""

import pathlib
from dataclasses import dataclass

import numpy as np

import registration_data as data
import registration_plan as plan
import registration_plots as plots
from evaluation_data import Sweep, condense, read_log, read_logs
from evaluation_page import columns, millis, run_section, table

PLACES = ("kitchen", "apartment")


@dataclass
class Bar:
    """A figure and what it was to be: at most (`<=`) or at least (`>=`) a limit."""
    what: str
    value: float
    relation: str
    limit: float
    unit: str = ""

    @property
    def kept(self):
        return self.value <= self.limit if self.relation == "<=" else self.value >= self.limit

    def row(self):
        unit = f" {self.unit}" if self.unit else ""
        return [self.what, f"{self.value:.3g}{unit}", f"{self.relation} {self.limit:g}{unit}", "yes" if self.kept else "**missed**"]


def percent(share):
    return f"{100 * share:.0f}" if share in (0.0, 1.0) else f"{100 * share:.1f}"


def speed_section(output, bars):
    rows = read_logs([output / "kitchen/fields.csv", output / "kitchen/clouds.csv"])
    sweep = Sweep(rows)
    heads = columns(sweep)
    at_start = [row for row in rows if row["kind"] == "translation" and row["magnitude"] == 0.1]
    lines = []
    for method in plan.FIELD_METHODS + plan.CLOUD_METHODS:
        cell = sweep.cell(method, "translation", 0.1)
        success = [percent(sweep.cell(method, kind, magnitude).success) for kind, magnitude, _ in heads]
        lines.append([method, f"{cell.milliseconds:.3g}", f"{millis(cell.translation[1])} / {millis(cell.rotation[1])}", *success])
    ratios = {name: data.paired_ratio(at_start, *pair) for name, pair in
              {"dense": ("ours", "ours_dense"), "search_dense": ("search", "search_dense"), "gicp": ("GICP", "ours")}.items()}
    bars += [Bar("`track` from 0.1 m, per scan", sweep.cell("ours", "translation", 0.1).milliseconds, "<=", 3, "ms"),
             Bar("`search` from 0.1 m, per scan", sweep.cell("search", "translation", 0.1).milliseconds, "<=", 30, "ms"),
             Bar("time of `track`, compressed / not compressed", ratios["dense"], "<=", 1.0),
             Bar("time of PCL's GICP / time of `track`", ratios["gicp"], ">=", 10)]
    return "\n\n".join([
        "## Time per scan, side by side",
        f"Red kitchen, {sweep.scans} scans outside the map, {sweep.cell('ours', 'translation', 0.1).runs} runs per column, one "
        f"thread, processor time from 0.1 m. The methods take turns in {plan.ROUNDS} rounds of scans. Success: within 5 cm.",
        table(["method", "ms", "median [mm / mrad]", *(f"success from {head} [%]" for _, _, head in heads)], lines),
        f"Scan by scan from 0.1 m, medians: compressed / not compressed {ratios['dense']:.2f} (`track`), "
        f"{ratios['search_dense']:.2f} (`search`); GICP / ours {ratios['gicp']:.1f}."])


def cost_section(output, folder, bars):
    iteration = data.read_benchmarks(output / "benchmark/iteration_benchmark.json")
    kernel = data.read_benchmarks(output / "benchmark/kernel_benchmark.json")
    nanoseconds = {rank: 1e9 * s for rank, s in data.series(iteration, "overRank", "s_per_point_and_iteration")}
    dense = 1e9 * iteration["dense"]["s_per_point_and_iteration"]
    peak = kernel["peak"]["flops"]
    contraction = dict(data.series(kernel, "contraction", "flops"))
    bars.append(Bar("per point and iteration, all included, R=40", nanoseconds[40], "<=", 60, "ns"))
    plots.plot_cost(iteration, folder / "registration_cost.png")
    shares = ", ".join(f"{percent(flops / peak)} % at R={rank}" for rank, flops in contraction.items())
    return "\n\n".join([
        "## Cost of an iteration",
        "The last stage of a registration over all points of a scan of the simulated apartment: transform, field, residuals, "
        "normal equations and step, with warm caches (Google Benchmark, `iteration_benchmark`, `kernel_benchmark`).",
        table(["rank", *map(str, nanoseconds), "not compressed"],
              [["ns per point and iteration", *(f"{ns:.1f}" for ns in nanoseconds.values()), f"{dense:.1f}"]]),
        f"The contraction of columns reaches, of this machine's measured peak of {peak / 1e9:.0f} GFLOP/s "
        f"({kernel['peak'].get('label', '')}, one thread, registers only): {shares}. What padding to the vector width adds is "
        "not counted as work. It runs once per column, not per iteration: what is contracted is kept.",
        "![cost over points, rank and size of the map](registration_cost.png)"])


def first_scan_section(output, bars):
    iteration = data.read_benchmarks(output / "benchmark/iteration_benchmark.json")
    warm, first, cold = (1e3 * iteration[f"scan/{start}"]["seconds"] for start in ("warm", "first", "first_cold"))
    bars.append(Bar("first scan after loading / a warm one", first / warm, "<=", 3))
    return "\n\n".join([
        "## The first scan",
        "A whole registration from 0.1 m. What is kept around the surface is made when the map is loaded.",
        table(["", "ms", "times a warm one"],
              [["again and again", f"{warm:.2f}", "1"],
               ["first scan after loading", f"{first:.2f}", f"{first / warm:.1f}"],
               ["the same with nothing left in the processor's caches", f"{cold:.2f}", f"{cold / warm:.1f}"]])])


def global_section(output, bars):
    lines = []
    for place in PLACES:
        for scans_of in PLACES:
            for hint, label in (("gravity", "known to 0.1 rad"), ("unaided", "unknown")):
                path = output / f"global/{scans_of}_in_{place}_{hint}.csv"
                if not path.exists():
                    continue
                rows = read_log(path)
                if not rows:
                    continue
                found = data.answers(rows, scans_of == place)
                own = scans_of == place
                lines.append([place, scans_of, label, str(found.scans), percent(found.near / found.scans) if own else "",
                              f"{found.wrong}", percent(found.refused / found.scans),
                              f"{found.seconds[0]:.2f} ({found.seconds[1]:.2f})", f"{found.processor:.2f}"])
                if own:
                    share, seconds = (95, 2) if hint == "gravity" else (90, 10)
                    bars.append(Bar(f"no prior, {place}, gravity {label}: within 5 cm", 100 * found.near / found.scans, ">=", share, "%"))
                    bars.append(Bar(f"no prior, {place}, gravity {label}: median wall clock", found.seconds[0], "<=", seconds, "s"))
                else:
                    bars.append(Bar(f"scans of the {scans_of} refused in the map of the {place}",
                                    100 * found.refused / found.scans, ">=", 95, "%"))
    return "\n\n".join([
        "## Without a prior",
        "Scans outside the map, two threads; on a busy machine the wall clock says as much about the others. In a map of another "
        "place every accepted answer is wrong.",
        table(["map", "scans of", "gravity", "scans", "within 5 cm [%]", "accepted but wrong", "refused [%]",
               "wall clock, median (largest) [s]",
               "processor time, both threads [s]"], lines)])


def covariance_section(output, bars):
    lines = []
    batch = output / "covariance/batch"
    for name, title in plan.COVARIANCE_MAPS.items():
        trials, _, scans = data.read_uncertainty(output / f"covariance/{name}.csv", batch)
        c = data.consistency(trials)
        lines.append([title, f"{c.trials} of {scans}", *(f"{100 * share:.1f}" for share in c.within), percent(c.all_within),
                      f"{c.median_square:.1f} / {c.mean_square:.1f}", percent(c.below_99),
                      f"{1e3 * np.linalg.norm(c.sigma[3:]):.1f} / {1e3 * np.linalg.norm(c.spread[3:]):.1f}"])
        if name == "kinect_40":
            bars.append(Bar("truth within 3 sigma, mean of coordinates", 100 * c.within.mean(), ">=", 99, "%"))
            bars.append(Bar("truth within 3 sigma, worst coordinate", 100 * c.within.min(), ">=", 99, "%"))
    weak = []
    for world, wanted in plan.DEGENERATE.items():
        folder = output / "degenerate" / world
        _, counts, scans = data.read_uncertainty(folder / "log.csv", folder / "batch")
        right = sum(count >= wanted for count in counts)
        weak.append([world, str(wanted), f"{right} of {scans}", ", ".join(f"{n}: {counts.count(n)}" for n in sorted(set(counts)))])
        bars.append(Bar(f"weak directions of a {world.replace('_', ' ')} found ({wanted})", 100 * right / scans, ">=", 95, "%"))
    return "\n\n".join([
        "## Covariance",
        "Scans of the simulated apartment with a Kinect's noise, exact poses, `track` from 0.05 m and 0.03 rad; accepted estimates. "
        "Errors are twists about the sensor's position in the axes of the map. Squared Mahalanobis distances of a right "
        "covariance have median 5.3 and mean 6, 99 % of them are below 16.8.",
        table(["map", "scans", *(f"{name} [%]" for name in data.COORDINATES), "all six [%]", "squared distance, median / mean",
               "below 16.8 [%]", "position: sigma reported / rms error [mm]"], lines),
        "Directions without information, in worlds that leave some (`test/registration/registration_test.cpp` has the same on "
        "exact fields). More are reported where a view shows too little of a surface, as of the corridor's floor:",
        table(["world", "weak directions", "at least as many found", "number reported: scans"], weak)])


def exact_section(output, bars):
    rows = read_log(output / "exact/log.csv")
    lines = []
    for method in ("not_compressed", "rank_80"):
        cell = condense([row for row in rows if row["method"] == method])
        voxels = cell.translation[1] / 0.02
        lines.append([method, str(cell.runs), f"{1e3 * cell.translation[1]:.2f} ({1e3 * cell.translation[0]:.2f}-"
                      f"{1e3 * cell.translation[2]:.2f})", f"{1e3 * cell.rotation[1]:.2f}", f"{voxels:.3f}"])
        bars.append(Bar(f"no noise, {method.replace('_', ' ')}: median error", voxels, "<=", 0.05, "voxel"))
    return "\n\n".join([
        "## Without noise",
        "Simulated apartment, depth exact to 0.1 mm, 2 cm voxels, scans outside the map, from 0.05 m.",
        table(["map", "scans", "median (quartiles) [mm]", "[mrad]", "median [voxel]"], lines)])


def write(output, folder, facts):
    """Writes registration.md and its pictures into `folder`; returns the page's path."""
    output, folder = pathlib.Path(output), pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    bars = []
    sections = [speed_section(output, bars), cost_section(output, folder, bars), first_scan_section(output, bars),
                global_section(output, bars), covariance_section(output, bars), exact_section(output, bars)]
    missed = [bar.what for bar in bars if not bar.kept]
    verdict = f"{len(bars) - len(missed)} of {len(bars)} bars are kept." + (f" Missed: {'; '.join(missed)}." if missed else "")
    page = folder / "registration.md"
    page.write_text("\n\n".join(["# Registration: speed, reach, honesty", run_section(facts), verdict,
                                 table(["", "measured", "bar", "kept"], [bar.row() for bar in bars]), *sections]) + "\n")
    return page
