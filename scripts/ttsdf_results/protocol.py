"""What is run on a scene: maps, and sweeps of methods over the same scans and perturbations."""

import csv
import json
from dataclasses import dataclass, field, replace

from .scenes import frames_of
from .store import OUT, Step

MAP, LOG, MEMORY = "map.ttsdf", "log.csv", "memory.csv"
RANKS = (60, 40)
CORES = "paper_cores"  # sweep that times the paper's method
PAPER_RANK = 70  # what the paper's memory table implies
# The paper's map: a distance transform or the fused distance, truncated SVD, 32-bit cores, nothing else.
PLAIN = ("--clamp-negative", 0, "--clamp-positive", 0, "--refine-iterations", 0, "--encoding", "float32",
         "--align-axes", "false", "--support-mask", "false")
# row of the table -> options of its field. The paper leaves open what "isocontours as occupancy grid" are.
PAPER_FIELDS = {
    "SDF": ("--sdf-method", "occupancy_edt"),
    "SDF_signed": ("--sdf-method", "occupancy_edt_signed"),
    "SDF_negative": ("--sdf-method", "occupancy_edt_negative"),
    "TSDF": ("--field", "tsdf"),
}
# Settings of the point cloud methods: the best found on the red kitchen; until they stop by themselves.
CLOUDS = {
    "ICP": "open3d_icp:max_correspondence_distance=1.0",
    "ICP_plane": "open3d_icp_plane:max_correspondence_distance=1.0",
    "GICP": "gicp",
    "NDT": "ndt",
}
WITHOUT_PRIOR = {"FGR": "fgr", "RANSAC": "ransac"}


@dataclass(frozen=True)
class Plan:
    """How much is run."""
    scans: int = 10
    directions: int = 2
    translations: str = "0.05,0.1,0.2,0.5,1.0"  # [m], as in the paper
    rotations: str = "0.1,0.25"                 # [rad]
    clouds: tuple = ("GICP", "ICP_plane")
    paper: tuple = ("SDF",)        # rows of PAPER_FIELDS, compressed
    dense: tuple = ()              # the same, not compressed
    small_clouds: bool = False     # clouds in as many bytes as our map
    without_prior: tuple = ()


QUICK = Plan(scans=5, directions=1, translations="0.05,0.2,0.5", rotations="0.25", clouds=("GICP",), paper=())
# The paper's own sweep: all magnitudes, five directions, every method.
PAPER_SWEEP = Plan(scans=20, directions=5, rotations="0.01,0.02,0.05,0.1,0.25", clouds=tuple(CLOUDS), paper=tuple(PAPER_FIELDS),
                   dense=("SDF", "TSDF"), small_clouds=True, without_prior=tuple(WITHOUT_PRIOR))
# The uncompressed flat takes 600 MB, more than a reader of maps allows.
SWEPT_AS_IN_THE_PAPER = {"redkitchen": PAPER_SWEEP, "apartment": replace(PAPER_SWEEP, scans=10, dense=())}


@dataclass
class SceneSteps:
    """`parts`: name -> (step of a sweep). `maps`: name -> step that made the map."""
    scene: object
    parts: dict = field(default_factory=dict)
    maps: dict = field(default_factory=dict)

    def chain(self):
        return in_order(self.parts.values())


class SceneProtocol:
    def __init__(self, scene, data, plan, ours=""):
        """`ours`: settings key=value,... of our registration, for trying out."""
        self.scene, self.plan = scene, plan
        self.settings = "," + ours if ours else ""
        self.data, self.frames = data, frames_of(scene, data)[1]
        self.steps = SceneSteps(scene)

    def build(self, name, *options, vdb=None):
        every, offset = self.scene.mapped
        source = ["--vdb", (vdb, "/volume.vdb")] if vdb else ["--frames", self.frames, "--every", every, "--offset", offset,
                                                              "--depth-scale", self.scene.depth_scale]
        step = Step(f"{self.scene.name}/map-{name}",
                    ["ttsdf_build", *source, *self.scene.map_options, "--output", OUT + "/" + MAP, "--report",
                     OUT + "/report.json", *options], ("build",))
        self.steps.maps[name] = step
        return step

    def sweep(self, name, code, methods, *options, once=False):
        """`once`: methods that do not use the prior answer the same to every perturbation."""
        plan = self.plan
        every, offset = self.scene.scan_selection(plan.scans)
        perturbed = (["--directions", 1, "--translations", "1.0", "--rotations", "none"] if once else
                     ["--directions", plan.directions, "--translations", plan.translations, "--rotations", plan.rotations])
        gravity = [f"--map-down={self.scene.down}"] if self.scene.down else []
        step = self.steps.parts[name] = Step(
            f"{self.scene.name}/{name}",
            ["ttsdf_evaluate", "--frames", self.frames, "--depth-scale", self.scene.depth_scale, "--every", every, "--offset",
             offset, "--max-depth", self.scene.max_depth, "--dataset", self.scene.name, *perturbed, *gravity, "--quiet",
             "--output", OUT + "/" + LOG, "--memory", OUT + "/" + MEMORY, *options, "--methods", *methods], code)
        return step

    def volume(self):
        """The fused volume, for maps that are made otherwise than from frames."""
        return self.build("volume", "--max-rank", 40, "--save-vdb", OUT + "/volume.vdb")

    def full(self):
        return self.build("full", "--max-rank", 0, "--refine-iterations", 0, "--encoding", "float32")

    def small_cloud(self, as_small_as, name):
        """A step that packs the point cloud into the bytes of a map."""
        every, offset = self.scene.mapped
        step = self.steps.parts[name] = Step(
            f"{self.scene.name}/small_cloud",
            ["@results", "small_cloud", "--frames", self.frames, "--depth-scale", self.scene.depth_scale, "--map-every", every,
             "--map-offset", offset, "--bytes-of", (as_small_as, "/" + MAP), "--output", OUT], ("sweep",))
        return step

    def ours(self):
        register = ("sweep", "register")
        maps = {rank: self.build(f"r{rank}", "--max-rank", rank) for rank in RANKS}
        methods = [(f"ours_r{rank}=track:map=", maps[rank], f"/{MAP}{self.settings}") for rank in RANKS]
        if self.plan.dense:
            methods.append(("ours_full=track:dense=true,map=", self.full(), f"/{MAP}{self.settings}"))
            methods.append(("ours_search=search:map=", maps[40], f"/{MAP}{self.settings}"))
        self.sweep("ours", register, methods)
        if self.plan.without_prior:
            self.sweep("ours_global", register, [("ours_global=global:map=", maps[40], f"/{MAP}{self.settings}")], once=True)

    def paper(self):
        if not self.plan.paper:
            return
        volume = self.volume()
        methods, cores = [], []
        for name in self.plan.paper:
            built = self.build(f"tt-{name}", "--max-rank", PAPER_RANK, *PLAIN, *PAPER_FIELDS[name], vdb=volume)
            # Decompressed once: the same numbers as from the cores, in time for a thousand runs ...
            methods.append((f"TT-{name}=paper:dense=true,map=", built, "/" + MAP))
            cores.append((f"TT-{name}=paper:cores=true,map=", built, "/" + MAP))
        for name in self.plan.dense:
            built = self.build(name, "--max-rank", 0, *PLAIN, *PAPER_FIELDS[name], vdb=volume)
            methods.append((f"{name}=paper:dense=true,map=", built, "/" + MAP))
        self.sweep("paper", ("paper",), methods)
        # ... whose time and memory are those of the cores.
        few = SceneProtocol(self.scene, self.data, replace(self.plan, scans=2, directions=1, translations="0.1", rotations="none"))
        self.steps.parts[CORES] = few.sweep(CORES, ("paper",), cores)

    def clouds(self):
        cell = ["--map-every", self.scene.mapped[0], "--map-offset", self.scene.mapped[1], "--cell", self.scene.cloud_cell]
        if self.plan.clouds:
            self.sweep("clouds", ("sweep",), [f"{name}={CLOUDS[name]}" for name in self.plan.clouds], *cell)
        if self.plan.without_prior:
            self.sweep("without_prior", ("sweep",),
                       [f"{name}={WITHOUT_PRIOR[name]}" for name in self.plan.without_prior], *cell, once=True)
        if self.plan.small_clouds:
            small = self.small_cloud(self.steps.maps["r40"], "small_cloud")
            del self.steps.parts["small_cloud"]  # no sweep: a step of the next one
            self.sweep("small_clouds", ("sweep",), ["GICP_small=gicp", "ICP_plane_small=open3d_icp_plane"],
                       "--map-cloud", (small, "/cloud.ply"))


def steps_of(scene, data, plan, ours=""):
    protocol = SceneProtocol(scene, data, plan, ours)
    protocol.ours()
    protocol.paper()
    protocol.clouds()
    return protocol.steps


def read_report(store, step):
    """What the build of a map reported, with the file's bytes."""
    folder = store.path(step)
    return {**json.loads((folder / "report.json").read_text()), "file_bytes": (folder / MAP).stat().st_size}


def read_memory(path):
    """method -> (bytes by the paper's formula, bytes measured)."""
    if not path.exists():
        return {}
    with path.open() as file:
        return {row["method"]: (int(row["paper_bytes"]), int(row["memory_bytes"])) for row in csv.DictReader(file)}


def in_order(steps):
    """The steps and all that they need, each once, needs first."""
    found = []

    def visit(step):
        for need in step.needs():
            visit(need)
        if all(step is not other for other in found):
            found.append(step)

    for step in steps:
        visit(step)
    return found
