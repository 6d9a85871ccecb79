"""doc/interface.md names every topic and service of the nodes; doc/messages.md holds every message and service as it is.

usage: interface_page_test.py [--update]: --update writes doc/messages.md.
"""

import pathlib
import re
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "doc" / "interface.md"
MESSAGES = REPOSITORY / "doc" / "messages.md"
HEAD = """# Messages and services

The files of `msg/` and `srv/` as they are, written by `scripts/update_pages`; do not edit. All belong to the package
`ttsdf_localization`. Who publishes and offers them: [interface](interface.md).
"""

# Topics and services as the sources name them.
NAMES = re.compile(r"(?:advertise\w*|subscribe)\s*(?:<[^()]*>)?\(\s*(?:\w+,\s*)?\"([\w/]+)\"")
# The demo's director uses the names of the others.
OTHERS = {"demo_ros.cpp"}


def messages():
    text = HEAD
    for folder in ("msg", "srv"):
        for path in sorted((REPOSITORY / folder).iterdir()):
            text += "\n## %s\n\n```text\n%s\n```\n" % (path.name, path.read_text(encoding="utf-8").strip())
    return text


def names():
    for folder in ("src/ros", "src/nodes"):
        for path in sorted((REPOSITORY / folder).rglob("*")):
            if path.is_file() and path.name not in OTHERS:
                for name in NAMES.findall(path.read_text(encoding="utf-8")):
                    yield path.name, name


def main(update):
    page = PAGE.read_text(encoding="utf-8")
    if update:
        MESSAGES.write_text(messages(), encoding="utf-8")
    problems = []
    if not MESSAGES.exists() or MESSAGES.read_text(encoding="utf-8") != messages():
        problems = ["msg/ and srv/ differ from doc/messages.md; run this test with --update"]
    found = list(names())
    if len(found) < 30:
        problems.append("only %d topics and services found in the sources, wanted at least 30" % len(found))
    problems += ["%s: `%s` is not in doc/interface.md" % (file, name) for file, name in found
                 if "`%s`" % name not in page and "`~%s`" % name not in page]
    print("\n".join(problems) or "%d names found in doc/interface.md" % len(found))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main("--update" in sys.argv))
