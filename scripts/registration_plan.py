"""What scripts/registration_report runs, as steps (one command each), and where their logs are."""

from dataclasses import dataclass

from evaluation_plan import Step, frame_indices, gravity_of

ROUNDS = 4  # the methods take turns, so that all see the same load of the machine
FIELD_METHODS = ("ours", "ours_dense", "search", "search_dense", "one_start")
CLOUD_METHODS = ("ICP", "ICP_plane", "GICP", "NDT")
SPECS = {"ours": "track", "ours_dense": "track:dense=true", "search": "search", "search_dense": "search:dense=true",
         "one_start": "track:restarts=0", "ICP": "icp", "ICP_plane": "icp_plane", "GICP": "gicp", "NDT": "ndt"}
# world -> directions without information
DEGENERATE = {"corridor": 1, "single_wall": 3, "floor": 3}
# maps that covariances are measured in, and what they are made of
COVARIANCE_MAPS = {"kinect_40": "Kinect frames, R=40", "exact_full": "exact depth, not compressed",
                   "exact_80": "exact depth, R=80"}
BENCHMARKS = ("kernel_benchmark", "iteration_benchmark")
COVARIANCE_SCANS = 300  # at least


@dataclass
class Selection:
    """How much of everything is run."""
    scans: int = 20  # of the red kitchen per sweep, and of every question without a prior
    directions: int = 2
    apartment_frames: int = 1000
    exact_frames: int = 600

    @property
    def global_scans(self):
        return self.scans

    @property
    def unaided_scans(self):
        """Without gravity every answer takes seconds."""
        return max(1, self.scans // 2)


def thinned(candidates, wanted):
    """Every how manieth of `candidates` frames gives about `wanted`."""
    return max(1, candidates // max(1, wanted))


def map_steps(frames, output):
    ten = ["--every", 10]
    exact = ["ttsdf_build", "--frames", output / "exact/frames", "--depth-scale", 10000, "--every", 5]
    built = [("red kitchen: map", ["ttsdf_build", "--frames", frames, *ten, "--max-rank", 40], "kitchen/map"),
             ("apartment: map of Kinect frames",
              ["ttsdf_build", "--frames", output / "apartment/frames", *ten, "--max-rank", 40], "apartment/kinect_40"),
             ("apartment: map of exact frames, R=80", [*exact, "--max-rank", 80], "apartment/exact_80"),
             ("apartment: map of exact frames, not compressed",
              [*exact, "--max-rank", 0, "--refine-iterations", 0, "--encoding", "float32"], "apartment/exact_full")]
    return [Step(title, [*command, "--output", output / f"{name}.ttsdf", "--report", output / f"{name}.json"],
                 [output / f"{name}.ttsdf"]) for title, command, name in built]


def world_steps(output, selection):
    def frames(name, *options):
        return Step(f"{name}: frames", ["ttsdf_simulate", "--output", output / name / "frames", "--threads", 2, *options],
                    [output / name / "frames"])
    return [frames("apartment", "--frames", selection.apartment_frames, "--sensor", "kinect"),
            frames("exact", "--frames", selection.exact_frames, "--depth-scale", 10000)]


def speed_steps(frames, output, selection):
    """The sweep in rounds over different scans, field methods and cloud methods one after the other in each."""
    step = 10 * thinned(len(frame_indices(frames)) // 10, selection.scans)
    steps = []
    for n in range(ROUNDS):
        common = ["ttsdf_evaluate", "--map", output / "kitchen/map.ttsdf", "--frames", frames, "--every", ROUNDS * step,
                  "--offset", 5 + n * step, "--translations", "0.1,0.5,1.0", "--rotations", "0.25", "--directions",
                  selection.directions, "--dataset", "kitchen", "--quiet"]
        for log, methods, repeat in (("fields", FIELD_METHODS, 5), ("clouds", CLOUD_METHODS, 1)):
            specs = [f"{label}={SPECS[label]}" for label in methods]
            steps.append(Step(f"red kitchen: {log}, round {n + 1} of {ROUNDS}",
                              [*common, "--repeat", repeat, "--output", output / f"kitchen/{log}.csv", "--methods", *specs],
                              [output / f"kitchen/{log}.csv"]))
    return steps


def global_steps(frames, output, selection):
    """Questions without a prior: the place's own scans, with and without gravity, and scans of the other place."""
    places = {"kitchen": (frames, output / "kitchen/map.ttsdf", gravity_of(frames)),
              "apartment": (output / "apartment/frames", output / "apartment/kinect_40.ttsdf", "0,0,-1")}
    count = {"kitchen": len(frame_indices(frames)) // 10, "apartment": selection.apartment_frames // 10}
    steps = []
    for place, (own, own_map, down) in places.items():
        for scans_of, (scans, _, _) in places.items():
            for hint in ("gravity", "unaided"):
                if hint == "gravity" and not down or scans_of != place and hint == "gravity":
                    continue
                wanted = selection.global_scans if hint == "gravity" else selection.unaided_scans
                gravity = [f"--map-down={down}", "--gravity-sigma", 0.1] if hint == "gravity" else []
                log = output / f"global/{scans_of}_in_{place}_{hint}.csv"
                steps.append(Step(f"without a prior: {scans_of} in the map of the {place}, {hint}",
                                  ["ttsdf_evaluate", "--map", own_map, "--frames", scans, "--every",
                                   10 * thinned(count[scans_of], wanted), "--offset", 5, "--translations", "0.05",
                                   "--rotations", "none", "--directions", 1, "--quiet", "--output", log, "--methods",
                                   "global", *gravity], [log]))
    return steps


def covariance_steps(output, selection):
    every = thinned(selection.apartment_frames, COVARIANCE_SCANS)
    batch = output / "covariance/batch"
    steps = [Step("covariance: scans", ["@frames_to_batch", output / "apartment/frames", batch, "--every", every, "--offset", 1],
                  [batch])]
    for name in COVARIANCE_MAPS:
        dense = ["--dense"] if name == "exact_full" else []
        steps.append(register_step(f"covariance: {name}", output / f"apartment/{name}.ttsdf", batch,
                                   output / f"covariance/{name}", dense))
    for world in DEGENERATE:
        folder = output / "degenerate" / world
        steps += [Step(f"{world}: frames", ["ttsdf_simulate", "--scene", world, "--output", folder / "frames", "--frames", 40,
                                            "--sensor", "kinect"], [folder / "frames"]),
                  Step(f"{world}: map", ["ttsdf_build", "--frames", folder / "frames", "--every", 2, "--output",
                                         folder / "map.ttsdf"], [folder / "map.ttsdf"]),
                  Step(f"{world}: scans", ["@frames_to_batch", folder / "frames", folder / "batch", "--every", 2, "--offset", 1],
                       [folder / "batch"]),
                  register_step(f"{world}: weak directions", folder / "map.ttsdf", folder / "batch", folder / "log")]
    return steps


def register_step(title, tt_map, batch, log, options=()):
    made = [log.with_suffix(".csv"), log.with_name(log.name + "_uncertainty.csv")]
    return Step(title, ["ttsdf_register", "--map", tt_map, "--batch", batch / "list.txt", "--output", made[0],
                        "--uncertainty", made[1], *options], made)


def exact_steps(output, selection):
    """Scans without noise, half-way between mapped frames."""
    log = output / "exact/log.csv"
    scan_step = 5 * thinned(selection.exact_frames // 5, selection.scans)
    maps = {name: output / f"apartment/{name}.ttsdf" for name in ("exact_full", "exact_80")}
    return [Step("exact scans", ["ttsdf_evaluate", "--frames", output / "exact/frames", "--depth-scale", 10000, "--every",
                                 scan_step, "--offset", 2, "--translations", "0.05", "--rotations", "none", "--directions", 1,
                                 "--quiet", "--output", log, "--methods",
                                 f"not_compressed=track:dense=true,map={maps['exact_full']}",
                                 f"rank_80=track:map={maps['exact_80']}"], [log])]


def benchmark_steps(output, programs):
    return [Step(f"benchmark: {name}", [program, f"--benchmark_out={output}/benchmark/{name}.json",
                                        "--benchmark_out_format=json", "--benchmark_min_time=0.05"],
                 [output / f"benchmark/{name}.json"]) for name, program in programs.items()]


def whole_plan(frames, output, selection, programs):
    """`programs`: where the benchmarks are."""
    return [*benchmark_steps(output, programs), *world_steps(output, selection), *map_steps(frames, output),
            *speed_steps(frames, output, selection), *exact_steps(output, selection), *covariance_steps(output, selection),
            *global_steps(frames, output, selection)]
