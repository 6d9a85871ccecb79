"""usage: tools_page_test.py TOOL_FOLDER [--update]: doc/tools.md holds the help text of every program and node, which
needs no master; a node's names every topic and service of doc/interface.md."""

import os
import pathlib
import re
import subprocess
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "doc" / "tools.md"
INTERFACE = REPOSITORY / "doc" / "interface.md"
NO_MASTER = "http://localhost:1"  # nobody listens there

HEAD = """# Programs

What `--help` prints, written by `test/documentation/tools_page_test.py TOOL_FOLDER --update`; do not edit. Programs close
with exit code 0 on success, 2 on wrong usage and 1 on failure, with one line on stderr that says what, got and wanted.
"""

SECTIONS = (
    ("Maps, without ROS", "In `devel/lib/ttsdf_localization` of the build folder.",
     ("ttsdf_build", "ttsdf_export", "ttsdf_info", "ttsdf_query", "ttsdf_convert", "ttsdf_atlas", "ttsdf_register", "ttsdf_evaluate",
      "ttsdf_simulate")),
    ("Maps and bags, with ROS libraries but without a master", "In the same folder.", ("offline_localizer",)),
    ("Nodes", "In the same folder; the help needs no master.",
     ("localization_node", "map_builder_node", "map_server_node", "operator_menu_node", "map_surface_node",
      "simulated_camera_node", "demo_node")),
    ("Scripts", "In `scripts/`.",
     ("demo", "test", "setup", "build", "fresh", "platforms", "build_seconds", "package", "robot_root", "cross_arm64",
      "atlas_dask", "atlas_scale", "frames_from", "frames_to_bag", "frames_to_batch", "evaluate_trajectory",
      "evaluate", "results", "reliability", "plot_map", "benchmark", "screenshot", "fuzz", "update_pages")),
)


def help_text(program):
    environment = dict(os.environ, COLUMNS="110", LC_ALL="C.UTF-8", ROS_MASTER_URI=NO_MASTER)
    result = subprocess.run([str(program), "--help"], env=environment, timeout=60, universal_newlines=True,
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    if result.returncode != 0 or result.stderr:
        raise RuntimeError("%s --help: exit code %d, %s" % (program, result.returncode, result.stderr))
    lines = result.stdout.replace("optional arguments:", "options:").splitlines()  # older argparse
    return "\n".join(line.rstrip() for line in lines).strip()


def page(tools):
    text = HEAD
    for title, where, programs in SECTIONS:
        text += "\n## %s\n\n%s\n" % (title, where)
        for name in programs:
            script = REPOSITORY / "scripts" / name
            text += "\n### %s\n\n```text\n%s\n```\n" % (name, help_text(script if script.exists() else tools / name))
    return text


def forgotten():
    """Programs that no section names."""
    named = {name for _, _, programs in SECTIONS for name in programs}
    tools = {path.stem for path in (REPOSITORY / "src" / "tools").glob("ttsdf_*.cpp")}
    scripts = {path.name for path in (REPOSITORY / "scripts").iterdir()
               if path.is_file() and os.access(str(path), os.X_OK) and not path.suffix}
    tools |= {path.stem for path in (REPOSITORY / "src" / "nodes").glob("*_node.cpp")}
    return sorted((tools | scripts) - named - {"summarize_tests"})  # part of scripts/test


def unnamed(tools):
    """Topics and services that doc/interface.md gives a node and its help does not name."""
    for section in INTERFACE.read_text(encoding="utf-8").split("\n## ")[1:]:
        node = re.match(r"\w+", section).group()
        if not node.endswith("_node"):
            continue
        words = set(re.split(r"[\s,;]+", help_text(tools / node)))
        head = section.partition("\n### ")[0]
        cells = re.findall(r"^\| ((?:`[~/\w]+`(?:, )?)+) \| [\w/]+", head, re.M)
        for name in re.findall(r"`([~/\w]+)`", " ".join(cells)):
            if name not in words:
                yield "%s --help does not name %s" % (node, name)


def main(tools, update):
    if forgotten():
        print("%s does not name %s" % (PAGE, ", ".join(forgotten())))
        return 1
    wanted = page(pathlib.Path(tools))
    if list(unnamed(pathlib.Path(tools))):
        print("\n".join(unnamed(pathlib.Path(tools))))
        return 1
    if update:
        PAGE.write_text(wanted, encoding="utf-8")
    got = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    if got == wanted:
        return 0
    differing = [(a, b) for a, b in zip(got.splitlines() + [""], wanted.splitlines() + [""]) if a != b]
    print("%s differs from the programs' help; run this test with --update. First line: got '%s', wanted '%s'" %
          ((PAGE,) + (differing or [("end", "end")])[0]))
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], "--update" in sys.argv))
