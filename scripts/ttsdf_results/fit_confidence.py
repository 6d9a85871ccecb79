"""Fits the confidence of a registration: the weights in src/registration/verification/verification.cpp.

usage: scripts/results fit_confidence SCENE=LOG.csv[,LOG.csv...]... [--right METRES]

A log is what ttsdf_register wrote for a batch with truth: near priors, far priors, priors of other places, so that it
holds right and wrong poses. Prints the weights of a logistic regression over all scenes, and for every scene what the
weights of the other scenes make of it: right poses refused, wrong ones accepted (confidence above 0.5), and how often
poses of a confidence were right.
"""

import argparse
import csv

import numpy as np

NAMES = ("constant", "evidence", "unexplained", "blocked", "unmapped")


def features(row):
    """As ttsdf::confidence does."""
    return np.array([1.0, np.clip(float(row["least_evidence"]), -1.0, 1.5), max(0.0, 0.92 - float(row["explained_ratio"])),
                     min(float(row["blocked_ratio"]), 0.2), max(0.0, float(row["unmapped_ratio"]) - 0.3)])


def read(paths, right):
    X, y = [], []
    for path in paths.split(","):
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                if row["reason"] in ("too_few_points", "outside_map", "unreadable") or not row["translation_error"]:
                    continue
                X.append(features(row))
                y.append(float(row["translation_error"]) < right)
    return np.array(X), np.array(y, dtype=float)


def fit(X, y, scene_weights, ridge=0.05):
    w = np.zeros(X.shape[1])
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-X @ w))
        H = (X * (scene_weights * p * (1.0 - p) + 1e-9)[:, None]).T @ X + ridge * np.diag([0.0] + [1.0] * (len(w) - 1))
        g = X.T @ (scene_weights * (y - p)) - ridge * np.r_[0.0, w[1:]]
        w = w + np.linalg.solve(H, g)
    return w


def balanced(parts):
    """Every scene counts alike, and right and wrong alike within all of them."""
    y = np.concatenate([p[1] for p in parts])
    per_scene = np.concatenate([np.full(len(p[1]), 200.0 / len(p[1])) for p in parts])
    share = np.sum(per_scene * y) / np.sum(per_scene)
    return per_scene * np.where(y > 0, 0.5 / share, 0.5 / (1.0 - share))


def main(arguments):
    parser = argparse.ArgumentParser(prog="results fit_confidence", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE=LOG.csv,...")
    parser.add_argument("--right", type=float, default=0.05, help="a pose nearer to the truth is right [m] (default 0.05)")
    a = parser.parse_args(arguments)
    scenes = {name: read(paths, a.right) for name, paths in (s.split("=", 1) for s in a.scenes)}

    def weights(parts):
        return fit(np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts]), balanced(parts))

    print("weights:", ", ".join(f"{n} {w:.2f}" for n, w in zip(NAMES, weights(list(scenes.values())))))
    everything = []
    for name, (X, y) in scenes.items():
        w = weights([p for other, p in scenes.items() if other != name]) if len(scenes) > 1 else weights([(X, y)])
        p = 1.0 / (1.0 + np.exp(-X @ w))
        everything.append((p, y))
        print(f"{name}: {int(y.sum())} right, refused {int(np.sum((p < 0.5) & (y > 0)))}; {int(len(y) - y.sum())} wrong, "
              f"accepted {int(np.sum((p >= 0.5) & (y == 0)))}")
    p, y = (np.concatenate(column) for column in zip(*everything))
    print("confidence: poses, right")
    for low, high in zip((0, .1, .3, .5, .7, .9, .97), (.1, .3, .5, .7, .9, .97, 1.01)):
        inside = (p >= low) & (p < high)
        if inside.any():
            print(f"{low:.2f} to {min(high, 1.0):.2f}: {int(inside.sum())}, {100 * y[inside].mean():.0f} %")
    return 0
