#include "atlas_tasks.h"

#include <json/value.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "ttsdf_localization/fusion/volume_parts.h"
#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {

namespace {

namespace fs = std::filesystem;
constexpr const char* kFolder = "unfinished_build";
constexpr const char* kSettings = "settings.json";
constexpr int kForm = 3;                 // rises when maps of the same cell come out differently
constexpr const char* kNoMap = "-";      // in place of a map's id
constexpr const char* kWhole = "whole";  // at the end of a result

const std::array<std::pair<const char*, double FrameAgreement::*>, 8> kFigures = {
    {{"position_median", &FrameAgreement::position_median},
     {"position_90", &FrameAgreement::position_90},
     {"rotation_median", &FrameAgreement::rotation_median},
     {"rotation_90", &FrameAgreement::rotation_90},
     {"widening", &FrameAgreement::widening},
     {"shift", &FrameAgreement::shift},
     {"turn_sensor", &FrameAgreement::turn_sensor},
     {"turn_scene", &FrameAgreement::turn_scene}}};
const std::array<std::pair<const char*, int FrameAgreement::*>, 3> kCounts = {
    {{"compared", &FrameAgreement::compared},
     {"contradicting", &FrameAgreement::contradicting},
     {"without_overlap", &FrameAgreement::without_overlap}}};

// Numbers are texts that read back as the same number.
template <class Options>
Json::Value textsOf(const OptionTable<Options>& table, const Options& options) {
  Json::Value object(Json::objectValue);
  for (const auto& row : table.rows()) object[row.name] = toString(row.get(options));
  return object;
}

template <class Options>
void readTexts(const Json::Value& object, const OptionTable<Options>& table, Options& options) {
  for (const std::string& name : object.getMemberNames())
    table.setFromText(options, name, object[name].asString());
}

constexpr std::array<const char*, 3> kPosition = {{"x", "y", "z"}}, kView = {{"view_x", "view_y", "view_z"}};

Json::Value textsOf(const ViewpointAgreement& v) {
  Json::Value object(Json::objectValue);
  for (int axis = 0; axis < 3; ++axis) {
    object[kPosition[axis]] = toString(v.viewpoint.position[axis]);
    object[kView[axis]] = toString(v.viewpoint.view[axis]);
  }
  object["frames"] = toString(v.frames);
  object["ratio"] = toString(v.ratio);
  return object;
}

Json::Value textsOf(const FrameAgreement& agreement) {
  Json::Value object(Json::objectValue);
  for (const auto& [name, figure] : kFigures) object[name] = toString(agreement.*figure);
  for (const auto& [name, count] : kCounts) object[name] = toString(agreement.*count);
  object["viewpoint_distance"] = toString(agreement.viewpoint_distance);
  object["viewpoints"] = Json::arrayValue;
  for (const ViewpointAgreement& v : agreement.viewpoints) object["viewpoints"].append(textsOf(v));
  return object;
}

std::uint64_t sumOf(std::uint64_t sum, const std::string& text) {
  for (const char byte : text) sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
  return sum;
}

/// Area of the observed surface [m2].
double areaOf(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3f a = mesh.vertices.col(mesh.triangles(0, n)),
                          b = mesh.vertices.col(mesh.triangles(1, n)),
                          c = mesh.vertices.col(mesh.triangles(2, n));
    area += 0.5 * static_cast<double>((b - a).cross(c - a).norm());
  }
  return area;
}

/// With the viewpoints in and beside a box: a hundred maps would hold those of the whole a hundred times, and
/// each of them would count as often where these maps are used together.
FrameAgreement agreementIn(Eigen::AlignedBox3d box, FrameAgreement agreement) {
  box.min().array() -= agreement.viewpoint_distance;
  box.max().array() += agreement.viewpoint_distance;
  auto& all = agreement.viewpoints;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [&](const auto& v) { return !box.contains(v.viewpoint.position); }),
            all.end());
  return agreement;
}

/// Nothing: there is no such file, or it cannot be read.
std::optional<std::string> textIn(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) return std::nullopt;
  return text.str();
}

double numberIn(const Json::Value& object, const std::string& name) {
  const std::string text = object[name].asString();
  try {
    std::size_t end = 0;
    const double number = std::stod(text, &end);
    if (end == text.size()) return number;
  } catch (const std::exception&) {
  }
  throw std::runtime_error("'" + name + "': got '" + text + "', wanted a number (build again)");
}

int countIn(const Json::Value& object, const std::string& name) {
  const double number = numberIn(object, name);
  if (number >= 0.0 && number <= std::numeric_limits<int>::max() && number == std::floor(number))
    return static_cast<int>(number);
  throw std::runtime_error("'" + name + "': got " + toString(number) +
                           ", wanted a whole number of 0 or more (build again)");
}

FrameAgreement readAgreementTexts(const Json::Value& object) {
  FrameAgreement agreement;
  for (const auto& [name, figure] : kFigures) agreement.*figure = numberIn(object, name);
  for (const auto& [name, count] : kCounts) agreement.*count = countIn(object, name);
  agreement.viewpoint_distance = numberIn(object, "viewpoint_distance");
  for (const Json::Value& one : object["viewpoints"]) {
    ViewpointAgreement v;
    for (int axis = 0; axis < 3; ++axis) {
      v.viewpoint.position[axis] = numberIn(one, kPosition[axis]);
      v.viewpoint.view[axis] = numberIn(one, kView[axis]);
    }
    v.frames = countIn(one, "frames");
    v.ratio = numberIn(one, "ratio");
    agreement.viewpoints.push_back(v);
  }
  check(agreement);
  return agreement;
}

}  // namespace

std::string TaskSettings::decisive() const {
  std::ostringstream text;
  text << kForm << ' ' << toString(min_surface);
  for (const auto& row : buildOptionTable().rows()) {
    if (row.name != "threads") text << ' ' << row.name << '=' << toString(row.get(build));
  }
  text << ' ' << toText(textsOf(agreement));
  return text.str();
}

TaskFolder::TaskFolder(const std::string& atlas_folder)
    : folder_(atlas_folder), tasks_((fs::path(atlas_folder) / kFolder).string()) {}

void TaskFolder::writeText(const std::string& path, const std::string& text) const {
  writeFileAtomically(path, text.data(), text.size());
}

void TaskFolder::writeSettings(const TaskSettings& settings) const {
  fs::create_directories(tasks_);
  Json::Value root;
  root["form"] = kForm;
  root["min_surface"] = toString(settings.min_surface);
  root["fusion"] = textsOf(fusionOptionTable(), settings.fusion);
  root["build"] = textsOf(buildOptionTable(), settings.build);
  root["agreement"] = textsOf(settings.agreement);
  root["cells"] = Json::arrayValue;
  for (const std::string& cell : settings.cells) root["cells"].append(cell);
  writeText(fileNamed(kSettings), toText(root));
}

TaskSettings TaskFolder::readSettings() const {
  const std::string path = fileNamed(kSettings);
  if (!fs::exists(path)) {
    throw std::runtime_error("'" + path +
                             "': no such file, wanted the folder of an atlas that is being built");
  }
  try {
    const auto text = textIn(path);
    if (!text) throw std::runtime_error("got a file that cannot be read, wanted the settings of a build");
    const Json::Value root = parseJson(*text, "settings");
    if (root["form"].asInt() != kForm) {
      throw std::runtime_error("got tasks of another version of this program (form " +
                               root["form"].asString() + "), wanted form " + std::to_string(kForm) +
                               " (build again)");
    }
    TaskSettings settings;
    settings.min_surface = numberIn(root, "min_surface");
    readTexts(root["fusion"], fusionOptionTable(), settings.fusion);
    readTexts(root["build"], buildOptionTable(), settings.build);
    settings.agreement = readAgreementTexts(root["agreement"]);
    for (const Json::Value& cell : root["cells"]) settings.cells.push_back(cell.asString());
    return settings;
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path + "': " + error.what());
  }
}

std::string TaskFolder::keyOf(const TsdfVolume& part, const std::string& decisive) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(sumOf(contentSum(part), decisive)));
  return text;
}

void TaskFolder::writeTask(const std::string& cell, const std::string& key, const TsdfVolume& part) const {
  if (keyOf(cell) == key && fs::exists(path(cell, ".vdb"))) return;
  fs::remove(path(cell, ".key"));
  part.saveVdb(path(cell, ".vdb"));
  writeText(path(cell, ".key"), key);
}

void TaskFolder::writeNoMap(const std::string& cell, const std::string& key) const {
  dropPart(cell);
  writeText(path(cell, ".key"), key);
  writeResult(cell, key, kNoMap);
}

void TaskFolder::writeResult(const std::string& cell, const std::string& key, const std::string& id) const {
  writeText(path(cell, ".result"), key + ' ' + id + ' ' + kWhole + '\n');
}

std::string TaskFolder::keyOf(const std::string& cell) const {
  return textIn(path(cell, ".key")).value_or("");
}

void TaskFolder::run(const std::string& cell) const {
  const TaskSettings settings = readSettings();
  const std::string key = keyOf(cell);
  if (key.empty()) {
    throw std::runtime_error("'" + path(cell, ".key") +
                             "': got no task, wanted one of a build that was begun");
  }
  if (made(cell, key)) return;
  const TsdfVolume part = TsdfVolume::fromVdbFile(path(cell, ".vdb"), settings.fusion);
  std::string id = kNoMap;
  const double area = part.empty() ? 0.0 : areaOf(extractSurface(part));
  if (area > 0.0 && area >= settings.min_surface) {
    const BuiltMap built =
        buildMap(part, settings.build, {}, agreementIn(surfaceBounds(part), settings.agreement));
    const AtlasMap entry = describeMap(cell, cell + ".ttsdf", built.bytes);
    writeFileAtomically(mapPath(folder_, entry), built.bytes, kMapFile);
    id = entry.map_id;
  }
  writeResult(cell, key, id);
}

std::optional<AtlasMap> TaskFolder::made(const std::string& cell, const std::string& key) const {
  std::istringstream words(textIn(path(cell, ".result")).value_or(""));
  std::string of, id, end;
  if (!(words >> of >> id >> end) || of != key || end != kWhole) return std::nullopt;
  if (id == kNoMap) return AtlasMap();
  AtlasMap map;
  map.file = cell + ".ttsdf";
  try {
    map = describeMap(cell, map.file, readFile(mapPath(folder_, map)));
  } catch (const std::exception&) {
    return std::nullopt;  // it is made again
  }
  if (map.map_id != id) return std::nullopt;
  return map;
}

void TaskFolder::dropPart(const std::string& cell) const {
  std::error_code ignored;
  fs::remove(path(cell, ".vdb"), ignored);
  fs::remove(path(cell, ".log"), ignored);
}

void TaskFolder::remove() const {
  std::error_code ignored;
  fs::remove_all(tasks_, ignored);
}

}  // namespace ttsdf
