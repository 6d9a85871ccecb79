"""doc/interface.md: holds every message and service as it is, and names every topic and service of the nodes.

usage: interface_page_test.py [--update]: --update writes the message files into the page.
"""

import pathlib
import re
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "doc" / "interface.md"
LAST_HEADING = "## Messages and services\n"

# Topics and services as the sources name them.
NAMES = re.compile(r"(?:advertise\w*|subscribe)\s*(?:<[^()]*>)?\(\s*(?:\w+,\s*)?\"([\w/]+)\"")
# The demo's director uses the names of the others.
OTHERS = {"demo_ros.cpp"}


def reference():
    text = ""
    for folder in ("msg", "srv"):
        for path in sorted((REPOSITORY / folder).iterdir()):
            text += "\n### %s\n\n```text\n%s\n```\n" % (path.name, path.read_text(encoding="utf-8").strip())
    return text


def names():
    for folder in ("src/ros", "src/nodes"):
        for path in sorted((REPOSITORY / folder).rglob("*")):
            if path.is_file() and path.name not in OTHERS:
                for name in NAMES.findall(path.read_text(encoding="utf-8")):
                    yield path.name, name


def main(update):
    page = PAGE.read_text(encoding="utf-8")
    head, _, tail = page.partition(LAST_HEADING)
    introduction = tail.partition("\n### ")[0].rstrip("\n") + "\n"
    wanted = head + LAST_HEADING + introduction + reference()
    if update:
        PAGE.write_text(wanted, encoding="utf-8")
        page = wanted
    problems = [] if page == wanted else ["msg/ and srv/ differ from doc/interface.md; run this test with --update"]
    found = list(names())
    if len(found) < 30:
        problems.append("only %d topics and services found in the sources, wanted at least 30" % len(found))
    problems += ["%s: `%s` is not in doc/interface.md" % (file, name) for file, name in found
                 if "`%s`" % name not in head and "`~%s`" % name not in head]
    print("\n".join(problems) or "%d names found in doc/interface.md" % len(found))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main("--update" in sys.argv))
