"""For doc/results/limits.md: failures that the other pages show, and what the comparison does not show."""

from . import facts
from .text import known

MEDIAN = 5.35  # of a chi square distribution with six degrees of freedom
AGREE = (0.6 * MEDIAN, 1.4 * MEDIAN)
WRONG = 0.01  # share of wrong answers that is named
FEW = 2  # scans that say little
DEFAULT_BOUND = 4  # memory_megabytes


def covariance(scenes, parts_of):
    """Paragraphs on the size of the covariance."""
    medians = {name: parts_of(figures)["ours_r40"]["reach"]["mahalanobis"] for name, figures in scenes.items()
               if "ours_r40" in parts_of(figures)}
    medians = {name: value for name, value in medians.items() if known(value)}
    wide = sorted(value for value in medians.values() if value < AGREE[0])
    if not wide:
        return []
    narrow = [f"{name} {value:.1f}" for name, value in medians.items() if value > AGREE[1]]
    return [f"The covariance is too wide: a right one has a median d² of {MEDIAN}, and at rank 40 it is {wide[0]:.1f} to {wide[-1]:.1f} in "
            f"{len(wide)} of {len(medians)} scenes. The standard deviations there are about {(MEDIAN / wide[-1]) ** 0.5:.1f} to "
            f"{(MEDIAN / wide[0]) ** 0.5:.1f} times what the errors are; a filter that fuses the pose trusts it too little." +
            (f" Too narrow: {', '.join(narrow)}." if narrow else "")]


def global_localization(places):
    for name, row in places.items():
        if name.endswith(", without priors"):
            largest = float(row[3].split(", ")[-1])
            if largest > 50.0:
                yield (f"- **Global localization can accept a wrong pose.** {name[:-len(', without priors')].capitalize()}, gravity known: "
                       f"{row[1]} are accepted, and the worst of them is {1e-3 * largest:.1f} m off. Within 5 cm, accepted or not, are "
                       f"{row[5]} ([memory](memory.md#other-places)).")


def refused(places):
    found = []
    for name, bounds in places.items():
        shown = next((b for b in bounds if isinstance(b, dict) and b["bound"] == DEFAULT_BOUND), None)
        if shown:
            good, scans = map(int, shown["success"].split(" of "))
            if good < 0.9 * scans:
                found.append(f"{name}: {shown['success']}")
    if found:
        yield ("- **Scans that are refused, with a good prior.** Registered are, " + "; ".join(found) + ". The others are refused, most "
               "because they do not fix all directions of the pose ([memory](memory.md#other-places)).")


def wrong_poses(runs):
    """`runs`: "scene rate odometry cut" -> figures."""
    for odometry, text in ((False, "without odometry"), (True, "with odometry")):
        found = []
        for key, run in runs.items():
            scene, rate, with_odometry, cut = key.split()
            if run["wrong"] and (with_odometry == "True") == odometry:
                found.append((scene, -float(rate), cut == "True",
                              f"{scene} {float(rate):g} Hz{', the middle cut out' if cut == 'True' else ''} {run['wrong']} of {run['poses']}"
                              f" (up to {run['largest']:.2f} m)"))
        if found:
            yield (f"- **Wrong poses along trajectories {text}**, published and further than 10 cm off: " +
                   "; ".join(line for *_, line in sorted(found)) + " ([trajectories](trajectories.md)).")
    lost = [(key.split()[0], run["poses"], run["scans"]) for key, run in runs.items()
            if run["poses"] < 0.1 * run["scans"] and key.endswith("False False")]
    if lost:
        yield (f"- **No pose at all, or hardly any, without odometry**: {len(lost)} of the runs of that page, of "
               f"{' and '.join(sorted({scene for scene, *_ in lost}))}, where the camera moves or turns far between two scans.")


FIXED = """
- **Trajectories depend on the processor.** In the building at 30 Hz without odometry commit 6a2d401 published no pose on one
  processor (Intel Xeon) and 27 on another (AMD EPYC), 9 of them wrong. The likely cause: kernels are compiled for several
  instruction sets, whose sums differ in their last digits, and without odometry each pose decides on the next guess.
- **Scans that are refused take longest.** They are tried again from many places: in the building with the default memory the
  slowest scans take 0.12 s, where most take 6 ms ([memory](memory.md#other-places)).
- **Rooms that look alike.** In a simulated hotel hardly any scan without a prior is located: most are called ambiguous,
  also in rooms that have no twin ([scale](../scale.md#without-a-prior)).
"""
CAVEATS = """
- **Settings of the other methods.** Those of GICP, ICP and NDT were chosen on the red kitchen only and used on all scenes; ours were
  developed while looking at these scenes ([methods](README.md#methods)); what would be chosen without one of them is in
  [constants](constants.md). The restarts near the prior (8, of which 4 are verified; `src/registration/hypotheses.cpp`) were chosen
  on icl_nuim, apartment_2 and room. The other methods have no test of their answers: a gate on their residual might lower their
  share of wrong answers, and was not tried.
- **Another day.** Scans lie between frames of the map, in most scenes within 0.17 s of the next one, in the same
  sequence ([how far](README.md#scans-beside-the-map)). No scene has a map of one day and scans of another.
- **The agreement of frames.** How near two viewpoints are that share it (10 voxels, 0.2 rad; `src/agreement/agreement_summary.cpp`)
  was chosen on frames of the red kitchen, its sparse map, tum_fr1_rpy and the table top: other frames than the scans, of the same places.
- **The paper's time** is the median of one to three runs, not of all.
"""


def failures():
    """Lines from memory.json and trajectories.json, where they exist, and of pages without figures."""
    memory, runs = facts.read("memory"), facts.read("trajectories")
    places = memory["figures"].get("places", {}) if memory else {}
    return [*global_localization(places), *refused(places), *wrong_poses(runs["figures"] if runs else {}), FIXED.strip()]


def caveats(scenes):
    few = [f"{name} ({figures['scans']})" for name, figures in scenes.items() if figures["scans"] <= FEW]
    lines = [f"- **Few scans.** {', '.join(few)} have one or two: their shares say little."] if few else []
    return [*lines, CAVEATS.strip()]
