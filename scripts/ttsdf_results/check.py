"""Says which pages of doc/results are older than the code that they measure.

usage: scripts/results check

A page is current while the digest of the sources it measures (comments, line breaks and includes left out) is the one that was
noted when it was made. Exit code 1 if any is not.
"""

import argparse
import json

from . import code, facts


def outdated(folder=facts.RESULTS):
    """(page, commit it was made at, parts of the code that changed since)."""
    for path in sorted(folder.glob("*.json")):
        noted = json.loads(path.read_text())
        changed = [part for part, digest in noted["code"].items() if code.digest((part,)) != digest]
        if changed:
            yield path.with_suffix(".md").name, noted["commit"], changed


def unaccounted(folder=facts.RESULTS):
    """Pages that nothing says of what code they are."""
    return [path.name for path in sorted(folder.glob("*.md")) if not path.with_suffix(".json").exists()]


def main(arguments):
    argparse.ArgumentParser(prog="results check", description=__doc__,
                            formatter_class=argparse.RawDescriptionHelpFormatter).parse_args(arguments)
    problems = [f"{page}: measured at commit {commit}; since then src/{{{','.join(code.folders(changed))}}} changed"
                for page, commit, changed in outdated()]
    problems += [f"{page}: got no {page[:-3]}.json beside it, wanted the figures it is made from" for page in unaccounted()]
    print("\n".join(problems) or "every page is of today's code")
    return 1 if problems else 0
