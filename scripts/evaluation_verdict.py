"""Where ours is ahead of every other method, and where it is not."""

from evaluation_data import KINDS, Sweep

OURS = ("ours", "ours_search", "ours_not_compressed", "ours_1cm", "ours_global")
NO_PEER = ("prior",)
MEDIAN_MARGIN = 1.05   # at most 5 % behind the best
RELIABLE = 0.5         # a method that fails more often than not has no median worth comparing with
RULES = ("Behind means: another method has more success; one that succeeds in at least half of the runs has a median error "
         "smaller by more than 5 %; one is faster; one has a smaller map.")


def peers(sweep):
    return [method for method in sweep.methods if method not in OURS + NO_PEER]


def compare(sweep, kind, magnitude):
    """Rows (figure, ours, best other, how far) where ours is behind at one magnitude."""
    ours = sweep.cell("ours", kind, magnitude)
    others = {m: sweep.cell(m, kind, magnitude) for m in peers(sweep)}
    others = {m: cell for m, cell in others.items() if cell}
    rows = []
    best = max(others, key=lambda m: others[m].success)
    if others[best].success > ours.success:
        rows.append(("success", f"{100 * ours.success:.0f} %", f"{best} {100 * others[best].success:.0f} %",
                     others[best].success - ours.success))
    reliable = {m: cell for m, cell in others.items() if cell.success >= RELIABLE}
    for error, unit in (("translation", "mm"), ("rotation", "mrad")) if reliable else ():
        best = min(reliable, key=lambda m: getattr(reliable[m], error)[1])
        own, peer = getattr(ours, error)[1], getattr(reliable[best], error)[1]
        if own > MEDIAN_MARGIN * peer:
            rows.append((f"median {error}", f"{1e3 * own:.1f} {unit}", f"{best} {1e3 * peer:.1f} {unit}", own / peer))
    return rows


def compare_group(title, sweep):
    """(magnitudes where nobody has more success, magnitudes, rows where ours is behind)."""
    rows, cells, ahead = [], 0, 0
    if "ours" not in sweep.methods or not peers(sweep):
        return 0, 0, rows
    for kind, unit in KINDS:
        for magnitude in sweep.magnitudes(kind):
            if not sweep.cell("ours", kind, magnitude):
                continue
            found = compare(sweep, kind, magnitude)
            cells += 1
            ahead += all(row[0] != "success" for row in found)
            rows += [(title, f"{magnitude:g} {unit}", *row) for row in found]
    others = {m: sweep.times[m] for m in peers(sweep)}
    fastest = min(others, key=others.get)
    if sweep.times["ours"] > others[fastest]:
        rows.append((title, "all", "time per scan", f"{sweep.times['ours']:.2g} ms", f"{fastest} {others[fastest]:.2g} ms",
                     0.0))
    return ahead, cells, rows


def worst(rows):
    """One line per data set and figure: at which perturbations, and the figures where it is farthest behind."""
    groups = {}
    for row in rows:
        groups.setdefault((row[0], row[2]), []).append(row)
    lines = []
    for (title, figure), group in groups.items():
        farthest = max(group, key=lambda row: row[5])
        at = ", ".join(row[1] for row in group)
        lines.append([title, figure, at, farthest[3], farthest[4]])
    return lines


def compare_maps(evaluation):
    """Rows for data sets in which the smallest other map is smaller than ours: as a file, and in memory."""
    rows, seen = [], set()
    for dataset, memory in evaluation.memory.items():
        name = dataset.split(":")[-1]  # a model has one map, whatever the sensor
        if name in seen:
            continue
        seen.add(name)
        others = {m: figures for m, figures in memory.items() if m not in OURS + NO_PEER}
        own = evaluation.map_file_bytes(dataset, "ours")
        if own is None or not others or "ours" not in memory:
            continue
        for what, mine, column in (("map file against the paper's count", own, 0),
                                   ("map in memory", memory["ours"][1], 1)):
            smallest = min(others, key=lambda m: others[m][column])
            if others[smallest][column] < mine:
                rows.append([name, what, "", f"{mine / 1e3:.0f} kB", f"{smallest} {others[smallest][column] / 1e3:.0f} kB"])
    return rows


def verdict_section(evaluation, title_of, table):
    parts, rows = [], []
    for group, log in evaluation.local.items():
        ahead, cells, found = compare_group(title_of(group), Sweep(log))
        parts.append(f"{title_of(group)} {ahead} of {cells}")
        rows += found
    rows = worst(rows) + compare_maps(evaluation)
    text = ("## Where ours is ahead, and where not\n\nMagnitudes of perturbation at which no other method has more "
            "success than ours: " + "; ".join(parts) + ".\n\n" + RULES)
    if not rows:
        return text + "\n\nOurs is behind nowhere."
    return text + ("\n\nOurs is behind here; the figures are those of the perturbation where it is farthest behind:\n\n"
                   + table(["data", "figure", "perturbations", "ours", "best other"], rows))
