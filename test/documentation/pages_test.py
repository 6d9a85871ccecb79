"""The pages of doc/ and the README against the tree: links lead somewhere, parameters exist, the messages that the
troubleshooting tables quote stand in the sources, and so do the files and names that the page of the structure points to;
pages for who starts are short."""

import pathlib
import re
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGES = sorted((REPOSITORY / "doc").glob("*.md")) + [REPOSITORY / "README.md"]
GROUPS = ("cloud", "gates", "motion", "recovery", "registration", "search", "global", "selection", "fusion", "build")


def anchors(text):
    """As the usual renderers make them of headings."""
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        yield re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def broken_links(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists():
            yield "%s: link to %s leads nowhere" % (page.name, target)
        elif anchor and anchor not in anchors(file.read_text(encoding="utf-8")):
            yield "%s: no heading for %s" % (page.name, target)


def too_long(page):
    """Three screens of 40 lines, for who starts."""
    lines = sum(max(1, -(-len(line) // 130)) for line in page.read_text(encoding="utf-8").splitlines())
    if lines > 120:
        yield "%s: got %d lines of at most 130 characters, wanted at most 120" % (page.name, lines)


def unknown_parameters(page, known):
    for group, name in re.findall(r"`(%s)/(\w+)(?![\w.])" % "|".join(GROUPS), page.read_text(encoding="utf-8")):
        if "%s/%s" % (group, name) not in known:
            yield "%s: `%s/%s` is no parameter" % (page.name, group, name)


def sources():
    """All string literals of the sources with those put together that the compiler puts together."""
    text = ""
    for path in sorted((REPOSITORY / "src").rglob("*.cpp")):
        text += re.sub(r"\"\s*\n\s*\"", "", path.read_text(encoding="utf-8"))
    return text.replace("\\'", "'")


def unknown_messages(page, literals):
    text = page.read_text(encoding="utf-8").partition("\n## Starting")[0]
    rows = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith("| it says")]
    if len(rows) < 30:
        yield "%s: only %d rows of troubleshooting found, wanted at least 30" % (page.name, len(rows))
    for row in rows:
        for message in re.findall(r"`([^`]+)`", row.split(" | ")[0]):
            for part in filter(None, (part.strip() for part in message.split("…"))):
                if part not in literals:
                    yield "%s: '%s' of `%s` is in no source file" % (page.name, part, message)


def files_of(*folders):
    return [path for folder in folders for path in (REPOSITORY / folder).rglob("*") if path.is_file() and path.suffix != ".pyc"]


def unknown_places(page):
    """Files and names in code font that are not in the tree."""
    files = [str(file) for file in files_of("src", "include", "test", "scripts", "launch", "config", "cmake")]
    words = set()
    for path in files_of("src", "include", "msg", "srv"):
        words.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    for place in re.findall(r"`([^`]+)`", page.read_text(encoding="utf-8").partition("\n## Where to change what")[2]):
        if "NAME" in place or " " in place or re.search(r"[^\w/.:]", place):
            continue
        if "/" in place:
            known = (REPOSITORY / place).exists() or any(place in file for file in files)
        elif "." in place:
            known = any(file.endswith("/" + place) for file in files)
        else:
            known = place.split("::")[-1] in words
        if not known:
            yield "%s: `%s` is not in the tree" % (page.name, place)


def main():
    known = set(re.findall(r"^\| `([\w/]+)`", (REPOSITORY / "doc" / "parameters.md").read_text(encoding="utf-8"),
                           re.MULTILINE))
    problems = []
    for page in PAGES:
        problems += list(broken_links(page)) + list(unknown_parameters(page, known))
    for name in ("install", "first_map", "first_localization", "own_camera", "bags", "tuning", "troubleshooting"):
        problems += list(too_long(REPOSITORY / "doc" / (name + ".md")))
    problems += list(unknown_messages(REPOSITORY / "doc" / "troubleshooting.md", sources()))
    problems += list(unknown_places(REPOSITORY / "doc" / "architecture.md"))
    print("\n".join(problems) or "%d pages agree with the tree" % len(PAGES))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
