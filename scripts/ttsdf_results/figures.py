"""The figures of an evaluation's logs: what pages, README and tests read."""

from dataclasses import asdict

from . import protocol
from .logs import condense, in_order, of_method, perturbation, perturbations, read_log

WITHIN = {"translation": 0.5, "rotation": 0.25}  # the reach that one number sums up [m], [rad]


def within_reach(row):
    return row["magnitude"] <= WITHIN[row["kind"]] + 1e-9


def plain(cell):
    """JSON has no NaN."""
    def clean(value):
        return [clean(v) for v in value] if isinstance(value, tuple) else None if value != value else round(value, 7)
    return {key: clean(value) for key, value in asdict(cell).items()}


def sweep_figures(rows, memory):
    result = {}
    for method in in_order(row["method"] for row in rows):
        mine = of_method(rows, method)
        result[method] = {
            "all": plain(condense(mine)),
            "reach": plain(condense([row for row in mine if within_reach(row)] or mine)),
            "success": [[kind, magnitude, round(condense([r for r in mine if perturbation(r) == (kind, magnitude)]).success, 5)]
                        for kind, magnitude in perturbations(mine)],
            "from_0.1": plain(condense([r for r in mine if perturbation(r) == ("translation", 0.1)])) if mine else None}
        if method in memory:
            result[method]["paper_bytes"], result[method]["memory_bytes"] = memory[method]
    return result


def scene_figures(store, steps):
    """Of one scene: sweeps by part, and what the builds reported."""
    figures = {"what": steps.scene.what, "parts": {}, "maps": {}}
    rows = {}
    for name, step in steps.parts.items():
        folder = store.path(step)
        rows[name] = read_log(folder / protocol.LOG)
        figures["parts"][name] = sweep_figures(rows[name], protocol.read_memory(folder / protocol.MEMORY))
    if protocol.CORES in figures["parts"]:  # what this sweep is for: cost; it has too few runs to say more
        rows.pop(protocol.CORES)
        for method, timed in figures["parts"].pop(protocol.CORES).items():
            row = figures["parts"]["paper"][method]
            row.update({key: timed[key] for key in ("paper_bytes", "memory_bytes") if key in timed})
            for cell in ("all", "reach", "from_0.1"):
                row[cell]["milliseconds"] = timed["all"]["milliseconds"]
    figures["scans"] = len({row["scan"] for part in rows.values() for row in part})
    for name, step in steps.maps.items():
        report = protocol.read_report(store, step)
        figures["maps"][name] = {key: value for key, value in report.items() if isinstance(value, (int, float, list, str))}
    return figures, [row for part in rows.values() for row in part]
