"""doc/behaviour_tests.md: names every rostest, and no test that does not exist.

usage: behaviour_page_test.py
"""

import pathlib
import re
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "doc" / "behaviour_tests.md"


def unit_tests():
    """Names of the unit tests' programs: <folder>_<file>."""
    tests = REPOSITORY / "test"
    return {"%s_%s" % (path.relative_to(tests).parts[0], path.stem) for path in tests.rglob("*_test.cpp")}


def methods(rostest):
    """Names of the tests inside a rostest: of its Python or C++ program."""
    text = ""
    for path in ("%s_test.py", "%s_test.cpp"):
        file = REPOSITORY / "test" / "ros" / (path % rostest)
        text += file.read_text(encoding="utf-8") if file.exists() else ""
    return re.findall(r"def (test_\w+)|TEST_F\(\w+, (\w+)\)", text)


def main():
    page = PAGE.read_text(encoding="utf-8")
    rostests = {path.stem for path in (REPOSITORY / "test" / "ros").glob("*.test")}
    cells = [row.split("|")[-2] for row in page.splitlines() if row.startswith("|")]
    problems = []
    for name in sorted(rostests):
        if "`%s`" % name not in page:
            problems.append("rostest %s is not in doc/behaviour_tests.md" % name)
    for cell in cells:
        rostest = None
        for word in re.findall(r"`([^`]+)`", cell):
            if word in rostests:
                rostest = word
            elif word.endswith("_test"):
                if word not in unit_tests():
                    problems.append("no such unit test: " + word)
            elif word.startswith("test_") or word.endswith("...") or word[0].isupper():
                known = [a or b for a, b in methods(rostest)] if rostest else []
                if not any(name.startswith(word.rstrip(".")) for name in known):
                    problems.append("no such test in %s: %s" % (rostest, word))
    print("\n".join(problems) or "%d rostests are in doc/behaviour_tests.md" % len(rostests))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
