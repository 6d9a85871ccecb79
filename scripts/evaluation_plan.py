"""What scripts/evaluate runs: finds the data sets, and turns them into steps (one command each)."""

import math
import pathlib
import re
from dataclasses import dataclass, field

MODELS = (".off", ".obj", ".ply")
SENSORS = ("none", "kinect")
# The paper's map: occupancy, distance transform, truncated SVD, nothing else.
PLAIN = ["--clamp-negative", "0", "--clamp-positive", "0", "--refine-iterations", "0", "--encoding", "float32",
         "--align-axes", "false", "--support-mask", "false"]
NEAREST = "interpolation=nearest,method=gauss_newton"  # as the paper evaluates its fields
PAPER_RANK = {"scene": 70, "object": 40}  # 70 is what the paper's memory table implies
OUR_RANK = 40
OBJECT_BYTES = 20000  # of our maps of objects: about what ICP's cloud of 2 cm cells takes by the paper's count
GRAVITY_FILE = "gravity-direction.txt"


class PlanError(Exception):
    pass


@dataclass
class Selection:
    """How much of everything is run."""
    scans: int = 20
    directions: int = 5
    views: int = 5
    ranks: tuple = (5, 10, 20, 30, 40, 60, 80)
    rank_scans: int = 10
    ransac_iterations: int = 50000
    sensors: tuple = SENSORS


QUICK = Selection(scans=3, directions=1, views=2, ranks=(5, 20), rank_scans=2, ransac_iterations=5000,
                  sensors=("kinect",))


@dataclass
class Step:
    """A command and the files it makes. Its arguments are its identity: a change makes it run again."""
    title: str
    command: list
    makes: list = field(default_factory=list)


@dataclass
class Scene:
    name: str
    frames: pathlib.Path
    depth_scale: float = 1000.0
    indices: list = field(default_factory=list)
    prepare: list = field(default_factory=list)  # steps that make the frames
    down: str = ""  # down direction in the map frame "x,y,z", if known
    share: float = 1.0  # of the selection's scans


@dataclass
class Model:
    name: str
    file: pathlib.Path


def frame_indices(folder):
    return sorted(int(m.group(1)) for m in (re.fullmatch(r"frame-(\d+)\.depth\.(png|pgm)", f.name)
                                            for f in folder.iterdir()) if m)


def gravity_of(folder):
    path = folder / GRAVITY_FILE
    return ",".join(path.read_text().split()) if path.exists() else ""


def with_intrinsics(folder, output):
    """(name, folder of frames with its intrinsics). 3DMatch keeps them beside the sequences: those are linked."""
    names = ("camera-intrinsics.txt", "intrinsics.K.txt")
    beside = folder.parent / names[0]
    if any((folder / name).exists() for name in names) or not beside.exists():
        return folder.name, folder
    name = f"{folder.parent.name}_{folder.name}"
    linked = output / name / "frames"
    linked.mkdir(parents=True, exist_ok=True)
    for file in [beside, *folder.glob("frame-*")]:
        if not (linked / file.name).is_symlink():
            (linked / file.name).symlink_to(file)
    return name, linked


def find_data(path, output, deeper=True):
    """Scenes and models at a path: a folder of frames, a TUM or Open3D folder, a model, or a folder of these."""
    path = pathlib.Path(path)
    if path.is_file() and path.suffix in MODELS:
        return [Model(path.stem, path)]
    if not path.is_dir():
        raise PlanError(f"--data: got '{path}', wanted a folder or a {', '.join(MODELS)} file")
    if any(path.glob("frame-*.depth.*")):
        name, frames = with_intrinsics(path.resolve(), output)
        return [Scene(name, frames, indices=frame_indices(path), down=gravity_of(path))]
    for kind, marks, scale in (("tum", ("depth.txt", "groundtruth.txt"), 5000.0),
                               ("log", ("depth", "trajectory.log"), 1000.0)):
        if all((path / mark).exists() for mark in marks):
            frames = output / path.name / "frames"
            step = Step(f"{path.name}: frames", ["@frames_from", kind, path, "--output", frames], [frames])
            images = sorted((path / "depth").glob("*"))
            return [Scene(path.name, frames, scale, list(range(len(images))), [step])]
    found = [Model(file.stem, file) for file in sorted(path.iterdir()) if file.suffix in MODELS]
    for folder in sorted(p for p in path.iterdir() if p.is_dir()) if deeper else []:
        found += find_data(folder, output, deeper=False)
    if not found and deeper:
        raise PlanError(f"--data: got '{path}', in which nothing has a known layout, wanted frame-NNNNNN.depth.png, a "
                        "TUM or Open3D folder, or models")
    return found


def simulated_scene(output, quick):
    """A world whose poses are exact: what error is left there belongs to the methods."""
    name = "room" if quick else "apartment"
    frames = output / name / "frames"
    count = 200 if quick else 1000
    small = ["--width", 320, "--height", 240, "--fx", 262.5, "--fy", 262.5] if quick else []
    step = Step(f"{name}: frames", ["ttsdf_simulate", "--scene", name, "--output", frames, "--frames", count,
                                    "--sensor", "kinect", *small], [frames])
    return Scene(name, frames, indices=list(range(count)), prepare=[step], down="0,0,-1", share=1.0 if quick else 0.5)


def write_chair(path):
    """A chair of boxes, for a run without any data: eight corners and six faces per box."""
    boxes = [((-20, -20, 42), (20, 20, 46)), ((-20, 16, 46), (20, 20, 95)), ((-19, -19, 0), (-15, -15, 42)),
             ((15, -19, 0), (19, -15, 42)), ((-19, 15, 0), (-15, 19, 42)), ((15, 15, 0), (19, 19, 42)),
             ((-28, -18, 62), (-20, 18, 66))]
    vertices, faces = [], []
    for low, high in boxes:
        first = len(vertices)
        vertices += [[(high if n >> axis & 1 else low)[axis] for axis in range(3)] for n in range(8)]
        faces += [[first + n for n in face] for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3),
                                                         (0, 4, 6, 2), (1, 3, 7, 5))]
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(str, v)) for v in vertices] + [" ".join(map(str, [4, *f])) for f in faces]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def build(title, source, output, name, *options):
    """A map, and its report beside it."""
    target = output / f"{name}.ttsdf"
    return Step(f"{title}: map {name}", ["ttsdf_build", *source, "--output", target, "--report", output / f"{name}.json",
                                         *options], [target])


def plain_fields(kind):
    """Options of the paper's two fields: the signed distance, and the truncated one."""
    if kind == "scene":
        return [*PLAIN, "--sdf-method", "occupancy_edt"], [*PLAIN, "--field", "tsdf"]
    clamped = list(PLAIN)
    clamped[1] = clamped[3] = OBJECT_TRUNCATION
    return PLAIN, clamped


def maps(title, source, output, kind, *first_options):
    """`first_options` go to the first map only: it is made from the frames, the others from what it saved. Objects have
    a finer map of ours, in a file as small as ICP's cloud, beside the one of the paper's voxels."""
    rank = PAPER_RANK[kind]
    sdf, tsdf = plain_fields(kind)
    full = ["--max-rank", 0]  # no cap: the array itself, up to rounding
    volume = ["--vdb", output / "volume.vdb"] if kind == "scene" else source
    uncompressed = [*full, "--refine-iterations", 0, "--encoding", "float32"]
    if kind == "object":
        fine = [source[0], source[1], *FINE_OBJECT_SCALE]
        ours = [build(title, fine, output, "ours", "--target-bytes", OBJECT_BYTES),
                build(title, fine, output, "ours_full", *uncompressed),
                build(title, source, output, "ours_1cm", "--max-rank", OUR_RANK)]
    else:
        ours = [build(title, source, output, "ours", "--max-rank", OUR_RANK, *first_options),
                build(title, volume, output, "ours_full", *uncompressed)]
    return [*ours,
            build(title, volume, output, "tt_sdf", "--max-rank", rank, *sdf),
            build(title, volume, output, "tt_tsdf", "--max-rank", rank, *tsdf),
            build(title, volume, output, "sdf", *full, *sdf),
            build(title, volume, output, "tsdf", *full, *tsdf)]


def field_methods(output, kind):
    coarse = [f"ours_1cm=track:map={output}/ours_1cm.ttsdf"] if kind == "object" else []
    return ["prior", "ours=track", "ours_search=search", f"ours_not_compressed=track:map={output}/ours_full.ttsdf,dense=true",
            *coarse,
            f"TT-SDF2PC=track:map={output}/tt_sdf.ttsdf,{NEAREST}", f"TT-TSDF=track:map={output}/tt_tsdf.ttsdf,{NEAREST}",
            f"SDF2PC=track:map={output}/sdf.ttsdf,dense=true,{NEAREST}",
            f"TSDF2PC=track:map={output}/tsdf.ttsdf,dense=true,{NEAREST}"]


CLOUD_METHODS = ["ICP=icp", "ICP_plane=icp_plane", "GICP=gicp", "NDT=ndt"]


def sweeps(title, common, output, tag, selection, field_specs, without_prior):
    """The sweep; methods without a prior once per scan, as they answer the same to every perturbation."""
    features = [f"FPFH_RANSAC=fpfh_ransac:ransac_iterations={selection.ransac_iterations}", "FPFH_FGR=fpfh_fgr"]
    once = ["--translations", "1.0", "--rotations", "none", "--directions", 1]
    parts = (("fields", ["--directions", selection.directions], field_specs),
             ("clouds", ["--directions", selection.directions], CLOUD_METHODS),
             ("global", once, [*without_prior, *features]))
    steps = []
    for name, options, methods in parts:
        log = output / f"{name}_{tag}.csv"
        steps.append(Step(f"{title}: {name}",
                          ["ttsdf_evaluate", *common, *options, "--quiet", "--output", log,
                           "--memory", output / f"memory_{name}_{tag}.csv", "--methods", *methods], [log]))
    return steps


def frame_selection(scene, selection):
    """(map every, scans every, scans offset): every 10th frame is mapped and scans lie half-way, if there are enough."""
    first, last = scene.indices[0], scene.indices[-1]
    every = 10 if len(scene.indices) >= 60 else 2
    candidates = max(1, (last - first + 1) // every)
    scans = max(1, int(scene.share * selection.scans))
    return every, every * math.ceil(candidates / scans), every // 2


def scene_common(scene, output, selection):
    every, scan_every, offset = frame_selection(scene, selection)
    return ["--frames", scene.frames, "--depth-scale", scene.depth_scale, "--map", output / scene.name / "ours.ttsdf",
            "--map-every", every, "--every", scan_every, "--offset", offset]


def scene_steps(scene, output, selection):
    folder = output / scene.name
    every = frame_selection(scene, selection)[0]
    source = ["--frames", scene.frames, "--depth-scale", scene.depth_scale, "--every", every]
    plan = maps(scene.name, source, folder, "scene", "--save-vdb", folder / "volume.vdb")
    plan[0].makes.append(folder / "volume.vdb")
    common = [*scene_common(scene, output, selection), "--dataset", scene.name]
    if scene.down:
        common.append(f"--map-down={scene.down}")
    return (list(scene.prepare) + plan
            + sweeps(scene.name, common, folder, "scans", selection, field_methods(folder, "scene"), ["ours_global=global"]))


OBJECT_TRUNCATION = "0.03"
OBJECT_SCALE = ["--voxel-size", "0.01", "--truncation", OBJECT_TRUNCATION]
FINE_OBJECT_SCALE = ["--voxel-size", "0.005", "--truncation", "0.015"]
OBJECT_CLOUD = ["--cell", "0.02", "--feature-cell", "0.02", "--fgr-distance", "0.02", "--ndt-resolution", "0.2",
                "--max-correspondence-distance", "0.5"]


def model_source(model, output, selection):
    return ["--mesh", output / model.name / f"frames_{selection.sensors[0]}" / "mesh.ply", *OBJECT_SCALE]


def model_common(model, output, sensor, selection):
    folder = output / model.name
    return ["--frames", folder / f"frames_{sensor}", "--depth-scale", 10000, "--map", folder / "ours.ttsdf",
            "--map-mesh", model_source(model, output, selection)[1], "--every", 1, "--offset", 0, "--stride", 4,
            *OBJECT_CLOUD]


def model_steps(model, output, selection):
    folder = output / model.name
    steps = []
    for sensor in selection.sensors:
        frames = folder / f"frames_{sensor}"
        steps.append(Step(f"{model.name}: views ({sensor})",
                          ["ttsdf_simulate", "--mesh", model.file, "--output", frames, "--views", selection.views,
                           "--sensor", sensor, "--depth-scale", 10000], [frames]))
    steps += maps(model.name, model_source(model, output, selection), folder, "object")
    for sensor in selection.sensors:
        label = "objects-exact" if sensor == "none" else f"objects-{sensor}"
        common = [*model_common(model, output, sensor, selection), "--dataset", f"{label}:{model.name}"]
        steps += sweeps(f"{model.name} ({sensor})", common, folder, sensor, selection,
                        field_methods(folder, "object"), [])
    return steps


def rank_steps(name, kind, source, common, output, selection):
    """Maps of several ranks of one data set, and a short sweep over all of them."""
    folder = output / name / "ranks"
    sdf = plain_fields(kind)[0]
    steps, methods = [], []
    for rank in selection.ranks:
        steps.append(build(f"{name}, rank {rank}", source, folder, f"ours_{rank}", "--max-rank", rank))
        steps.append(build(f"{name}, rank {rank}", source, folder, f"tt_sdf_{rank}", "--max-rank", rank, *sdf))
        methods += [f"ours R{rank}=track:map={folder}/ours_{rank}.ttsdf",
                    f"TT-SDF2PC R{rank}=track:map={folder}/tt_sdf_{rank}.ttsdf,{NEAREST}"]
    log = folder / "sweep.csv"
    steps.append(Step(f"{name}: rank sweep",
                      ["ttsdf_evaluate", *common, "--dataset", f"ranks:{name}", "--translations", "0.1", "--rotations",
                       "0.1", "--directions", selection.directions, "--quiet", "--output", log, "--methods", *methods],
                      [log]))
    return steps


def scene_rank_steps(scene, output, selection):
    few = Selection(**{**vars(selection), "scans": selection.rank_scans})
    volume = ["--vdb", output / scene.name / "volume.vdb"]
    return rank_steps(scene.name, "scene", volume, scene_common(scene, output, few), output, few)


def model_rank_steps(model, output, selection):
    return rank_steps(model.name, "object", model_source(model, output, selection),
                      model_common(model, output, selection.sensors[0], selection), output, selection)


def whole_plan(data, output, selection):
    """Every step in order. Ranks are swept on the first scene that is not simulated and on the armadillo (the paper's
    model), or on the first of each."""
    scenes = [d for d in data if isinstance(d, Scene)]
    models = [d for d in data if isinstance(d, Model)]
    names = [d.name for d in data]
    for name in names:
        if names.count(name) > 1:
            raise PlanError(f"--data: got two data sets called '{name}', wanted names of their own")
    steps = []
    for scene in scenes:
        steps += scene_steps(scene, output, selection)
    for model in models:
        steps += model_steps(model, output, selection)
    real = [s for s in scenes if not s.prepare] or scenes
    if real:
        steps += scene_rank_steps(real[0], output, selection)
    if models:
        steps += model_rank_steps(next((m for m in models if m.name == "armadillo"), models[0]), output, selection)
    return steps
