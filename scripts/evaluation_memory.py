"""The paper's memory table, with our columns."""

PAPER = (("red_kitchen", "26 757", "346 x 153 x 152", "320 kB", "32.2 MB", "3.1 MB"),
         ("analysis-by-synthesis-apt1-kitchen", "11 193", "184 x 210 x 116", "132 kB", "17.9 MB", "2.4 MB"),
         ("bundlefusion-apt0", "169 752", "321 x 295 x 301", "2.0 MB", "114.0 MB", "5.9 MB"),
         ("rgbd-scenes-v2-scene_01", "23 690", "265 x 136 x 265", "284 kB", "38.2 MB", "2.8 MB"),
         ("sun3d_at-home_at_scan1_2013_jan_1", "407 266", "736 x 309 x 934", "4.9 MB", "849.7 MB", "6.5 MB"))
BYTES_PER_POINT = 12


def size(count):
    if count is None:
        return ""
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"



def row_of(evaluation, dataset, memory):
    def paper(method):
        return memory[method][0] if method in memory else None

    def measured(method):
        return memory[method][1] if method in memory else None

    cloud = paper("ICP")
    return [dataset.split(":")[-1], f"{cloud // BYTES_PER_POINT}" if cloud else "", size(cloud), size(measured("ICP")),
            size(paper("SDF2PC")), size(paper("TT-SDF2PC")), size(paper("ours")),
            f"**{size(evaluation.map_file_bytes(dataset, 'ours'))}**", size(measured("ours")), size(paper("FPFH_FGR"))]


def memory_section(evaluation, table):
    rows, seen = [], set()
    for dataset, memory in evaluation.memory.items():
        name = dataset.split(":")[-1]
        if name in seen or dataset.startswith("ranks:"):
            continue
        seen.add(name)
        rows.append(row_of(evaluation, dataset, memory))
    head = ["data", "points", "point cloud", "... measured", "SDF", "TT-SDF (paper's)", "ours by the paper's formula",
            "ours, file", "ours in memory", "FPFH map"]
    return ("## Memory\n\nBy the paper's formulas (32-bit floats; a tensor train counted with R = max(R1, R2)) unless the "
            "column says otherwise. *Measured* and *in memory*: as it lies in this process's memory, with search "
            "structures, decoded bricks and the far field.\n\n" + table(head, rows)
            + "\n\nThe paper's own table, for its scenes (MSSVConv and Deep Multiview: 640 kB each):\n\n"
            + table(["scene", "points", "dimensions", "PC", "SDF", "TT-SDF"], [list(row) for row in PAPER]))
