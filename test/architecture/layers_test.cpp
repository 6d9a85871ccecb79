// doc/architecture.md, "Structure": reads every #include of the source tree and fails when an arrow turns
// round.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

const fs::path kRoot = TTSDF_SOURCE_DIR;

/// What each folder may include of the other folders.
const Names kCore = {"files", "options", "sensor", "geometry", "tensor", "field", "map"};
const Names kWings = {"build_steps", "readers", "frames",      "fusion",    "surface", "signed_field",
                      "mesh",        "mapping", "compression", "agreement", "exports"};

Names operator+(Names a, const Names& b) {
  a.insert(b.begin(), b.end());
  return a;
}

const std::map<std::string, Names> kMayUse = {
    // the robot's library: it only reads maps
    {"files", {}},
    {"options", {}},
    {"sensor", {}},
    {"geometry", {}},
    {"tensor", {}},
    {"field", {"geometry", "tensor"}},
    {"map", {"files", "geometry", "tensor", "field"}},
    {"registration", {"options", "geometry", "tensor", "field", "sensor"}},
    {"localization", {"options", "geometry", "field", "registration"}},
    {"yaml", {}},
    {"atlas", {"options", "geometry", "tensor", "field", "map", "files", "registration", "yaml"}},
    // the builder's: from depth or a mesh to a compressed map
    {"compression", {"files", "tensor", "field", "map"}},
    {"readers", {}},
    {"build_steps", {"options"}},
    {"frames", {"geometry", "readers"}},
    {"fusion", {"files", "options", "geometry", "tensor", "sensor", "frames", "build_steps", "readers"}},
    {"surface", {"tensor", "field", "build_steps"}},
    {"signed_field", {"geometry", "tensor", "field", "map", "build_steps", "fusion", "surface"}},
    {"mesh", {"readers", "geometry", "tensor", "field", "build_steps", "surface", "signed_field"}},
    {"mapping", {"tensor", "field", "map", "build_steps", "fusion", "signed_field", "compression"}},
    {"agreement", {"options", "geometry", "field", "registration", "frames", "fusion"}},
    {"exports", kCore + kWings},
    {"pcl", kCore + Names{"registration"}},  // a header for others
    // plain types of depth images and meshes: no link to their library, checked below
    {"simulation", {"options", "geometry", "tensor", "field", "frames", "surface"}},
    {"evaluation", kCore + kWings + Names{"registration"}},
    {"tools",
     kCore + kWings + Names{"registration", "localization", "simulation", "evaluation", "atlas", "yaml"}},
    {"ros", kCore + kWings +
                Names{"registration", "localization", "simulation", "evaluation", "tools", "atlas", "yaml"}},
    {"nodes", {"ros", "tools"}},
};

/// Libraries that only some folders may include, by the first folder of the include.
const std::map<std::string, Names> kOnlyIn = {
    {"openvdb", {"agreement", "fusion", "signed_field", "exports"}},
    {"octomap", {"exports"}},
    {"vigra", {"frames", "signed_field", "surface"}},
    {"assimp", {"mesh"}},
    {"tbb", {"build_steps", "fusion"}},
    {"pcl", {"evaluation", "pcl", "nodes"}},
    {"open3d", {"evaluation"}},
    {"boost", {"tools", "ros", "nodes"}},
    {"yaml-cpp", {"yaml", "atlas", "tools", "ros"}},
    {"json", {"mesh", "tools", "ros"}},
};

struct Include {
  fs::path file;
  std::string folder, text;
};

/// Folder of our own tree that a file belongs to: src/map/x.cpp and include/ttsdf_localization/map/x.h ->
/// map.
std::string folderOf(const fs::path& file) {
  fs::path relative = fs::relative(file, kRoot / "include" / "ttsdf_localization");
  if (*relative.begin() == "..") relative = fs::relative(file, kRoot / "src");
  return relative.begin()->string();
}

std::vector<Include> readIncludes() {
  static const std::regex kInclude(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> includes;
  for (const fs::path& top : {kRoot / "include", kRoot / "src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(top)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        std::smatch match;
        if (std::regex_search(line, match, kInclude))
          includes.push_back({entry.path(), folderOf(entry.path()), match[1]});
      }
    }
  }
  return includes;
}

const std::vector<Include>& includes() {
  static const std::vector<Include> kIncludes = readIncludes();
  return kIncludes;
}

/// "map" for ttsdf_localization/map/x.h and for ../../map/x.h; empty for anything else.
std::string ownFolder(const Include& include) {
  static const std::regex kOwn("^ttsdf_localization/([a-z_]+)/");
  std::smatch match;
  if (std::regex_search(include.text, match, kOwn)) return match[1].str();
  if (include.text.rfind("../", 0) != 0) return "";
  return folderOf((include.file.parent_path() / include.text).lexically_normal());
}

bool isRos(const std::string& include) {
  // roscpp and its kin, every message package, and our own generated messages (ttsdf_localization/Name.h).
  static const std::regex kRos(
      "^(ros|tf2\\w*|nodelet|pluginlib|\\w+_msgs|std_srvs|message_filters|diagnostic_updater|"
      "dynamic_reconfigure|rosbag|pcl_ros|pcl_conversions|image_geometry|depth_image_proc|xmlrpcpp)/|"
      "^XmlRpc|^ttsdf_localization/[A-Z]\\w*\\.h$");
  return std::regex_search(include, kRos);
}

std::string describe(const Include& include) {
  return fs::relative(include.file, kRoot).string() + " includes " + include.text;
}

TEST(Layers, TheTreeIsRead) {
  EXPECT_GT(includes().size(), 500u);
  Names folders;
  for (const Include& include : includes()) folders.insert(include.folder);
  for (const std::string& folder : folders)
    EXPECT_EQ(kMayUse.count(folder), 1u) << "unknown folder " << folder;
}

TEST(Layers, NoArrowTurnsRound) {
  for (const Include& include : includes()) {
    const std::string target = ownFolder(include);
    if (kMayUse.count(target) == 0 || target == include.folder)
      continue;  // a part of a folder is its own business
    EXPECT_EQ(kMayUse.at(include.folder).count(target), 1u) << describe(include);
  }
}

// What is not localization does not get into the localizer's node.
TEST(Layers, FoldersOfTheRosLayerKeepTheirOrder) {
  const std::map<std::string, Names> may_use = {
      {"messages", {}},
      {"parameters", {"messages"}},
      {"poses", {"messages", "parameters"}},
      {"scans", {"messages", "parameters", "poses"}},
      {"maps", {"messages", "parameters", "scans"}},
      {"node", {"messages", "parameters", "poses", "scans", "maps"}},
      {"offline", {"messages", "parameters", "poses", "scans", "maps", "node"}},
      {"server", {"messages", "maps"}},
      {"operator", {"parameters", "scans"}},
      {"builder", {"messages", "parameters", "scans", "server", "operator"}},
      {"demo", {"messages", "parameters"}},
  };
  static const std::regex kRosFolder("^ros/([a-z]+)/.*\\.h$");
  for (const Include& include : includes()) {
    std::smatch match;
    if (include.folder != "ros" || !std::regex_search(include.text, match, kRosFolder)) continue;
    const std::string from = fs::relative(include.file, kRoot / "src" / "ros").begin()->string();
    if (from == match[1]) continue;
    EXPECT_EQ(may_use.at(from).count(match[1]), 1u) << describe(include);
  }
}

TEST(Layers, RosIsInRosAndNodesOnly) {
  for (const Include& include : includes()) {
    if (include.folder == "ros" || include.folder == "nodes") continue;
    EXPECT_FALSE(isRos(include.text)) << describe(include);
  }
}

TEST(Layers, LibrariesStayInTheirLayer) {
  for (const Include& include : includes()) {
    const auto rule = kOnlyIn.find(include.text.substr(0, include.text.find('/')));
    if (rule == kOnlyIn.end()) continue;
    EXPECT_EQ(rule->second.count(include.folder), 1u) << describe(include);
  }
}

TEST(Layers, SimulationUsesOnlyPlainTypesOfMapping) {
  const Names plain = {"ttsdf_localization/frames/depth_image.h",
                       "ttsdf_localization/surface/surface_mesh.h"};
  for (const Include& include : includes()) {
    if (include.folder != "simulation" || kWings.count(ownFolder(include)) == 0) continue;
    EXPECT_EQ(plain.count(include.text), 1u) << describe(include);
  }
}

// A nodelet shares its process with others.
TEST(Layers, LibrariesNeitherPrintNorExit) {
  static const std::regex kForbidden(
      R"(std::(cout|cerr|exit|abort|terminate)\b|[^n]printf\(|\b(exit|abort)\()");
  for (const auto& [folder, uses] : kMayUse) {
    if (folder == "tools" || folder == "ros" || folder == "nodes") continue;
    for (const fs::path& top : {kRoot / "include" / "ttsdf_localization" / folder, kRoot / "src" / folder}) {
      if (!fs::exists(top)) continue;
      for (const auto& entry : fs::recursive_directory_iterator(top)) {
        std::ifstream file(entry.path());
        for (std::string line; std::getline(file, line);) {
          EXPECT_FALSE(std::regex_search(line, kForbidden))
              << fs::relative(entry.path(), kRoot) << ": " << line;
        }
      }
    }
  }
}

}  // namespace
