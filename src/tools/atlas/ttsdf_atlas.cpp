// Folders of maps: made, looked at, changed.

#include <array>
#include <cstring>
#include <iostream>

#include "atlas_commands.h"
#include "ttsdf_localization/tools/command_line.h"

namespace {

struct Command {
  const char* name;
  const char* summary;
  int (*run)(int, char**);
};

constexpr std::array<Command, 12> kCommands = {{
    {"build", "cut frames, a mesh, a cloud, a volume or an octree into maps", ttsdf::runAtlasBuild},
    {"cell", "make the map of one cell of a build that was begun", ttsdf::runAtlasCell},
    {"finish", "write the atlas when the commands of a build were run", ttsdf::runAtlasFinish},
    {"info", "list the maps and their neighbours", ttsdf::runAtlasInfo},
    {"check", "compare the map files with atlas.yaml", ttsdf::runAtlasCheck},
    {"add", "put a map file into the atlas, or its next version", ttsdf::runAtlasAdd},
    {"remove", "take maps out of the atlas", ttsdf::runAtlasRemove},
    {"update", "bring the maps that new frames see up to date", ttsdf::runAtlasUpdate},
    {"rollback", "make a map what it was before", ttsdf::runAtlasRollback},
    {"merge", "put all maps of another atlas into this one", ttsdf::runAtlasMerge},
    {"index", "look around in the maps, so that robots find the one they are in", ttsdf::runAtlasIndex},
    {"export", "write the surface of all maps as one mesh", ttsdf::runAtlasExport},
}};

void printHelp(std::ostream& out) {
  out << "usage: ttsdf_atlas COMMAND FOLDER [options]\n\nMakes, shows and changes folders of maps "
         "(atlas.yaml).\n\nCommands (each has --help):\n";
  for (const Command& command : kCommands) {
    out << "  " << command.name << std::string(10 - std::strlen(command.name), ' ') << command.summary
        << '\n';
  }
}

int run(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  if (name == "--help" || name == "-h") {
    printHelp(std::cout);
    return 0;
  }
  for (const Command& command : kCommands) {
    if (name == command.name) return command.run(argc - 1, argv + 1);
  }
  throw ttsdf::UsageError("got command '" + name + "', wanted one of those that --help lists");
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_atlas", [&] { return run(argc, argv); });
}
