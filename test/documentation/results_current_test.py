"""The pages of doc/results are of the code as it is, and README has their figures (scripts/results check, readme --check)."""

import pathlib
import subprocess
import sys

RESULTS = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "results"


def main():
    codes = [subprocess.run([sys.executable, "-B", str(RESULTS), *words]).returncode for words in (["check"], ["readme", "--check"])]
    if any(codes):
        print("measure again: scripts/evaluate --page doc/results, then the other commands of scripts/results")
    return 1 if any(codes) else 0


if __name__ == "__main__":
    sys.exit(main())
