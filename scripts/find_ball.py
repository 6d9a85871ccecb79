#!/usr/bin/python3
"""usage: find_ball.py IMAGE: prints the pixel in the middle of the operator's blue ball; exit code 1 if there is none."""

import sys

import numpy as np
from PIL import Image

LEAST_PIXELS = 30


def middle(pixels):
    """Of the pixels whose blue is far above red and green, as nothing else in rviz/localization.rviz is: those of the
    densest part, for other small things may be blue, too. None if there are too few."""
    r, g, b = (pixels[:, :, channel].astype(int) for channel in range(3))
    y, x = np.nonzero((b > 120) & (b > 1.7 * r) & (b > 1.5 * g) & (g > 1.3 * r))
    if len(x) < LEAST_PIXELS:
        return None
    for _ in range(10):  # the median, then of what lies around it
        near = np.hypot(x - np.median(x), y - np.median(y)) < 60.0
        x, y = x[near], y[near]
    return (int(np.median(x)), int(np.median(y))) if len(x) >= LEAST_PIXELS else None


def main():
    found = middle(np.array(Image.open(sys.argv[1]).convert("RGB")))
    if found is None:
        return 1
    print("%d %d" % found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
