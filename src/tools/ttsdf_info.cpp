// What a map holds.

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>

#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/json_file.h"
#include "ttsdf_localization/tools/map_memory.h"
#include "ttsdf_localization/tools/printable.h"
#include "ttsdf_localization/tools/progress.h"
#include "ttsdf_localization/tools/spectra.h"

namespace {

constexpr const char* kPlotScript = "plot_map";

Json::Value toJson(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  Json::Value list(Json::arrayValue);
  for (Eigen::Index n = 0; n < numbers.size(); ++n) list.append(numbers[n]);
  return list;
}

Json::Value toJson(const std::vector<double>& numbers) {
  return toJson(Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size())));
}

// The metadata are texts; those that are JSON themselves (the build report) go in as what they are.
Json::Value metadata(const ttsdf::TtSdfMap& map) {
  Json::Value root(Json::objectValue);
  for (const auto& [key, text] : map.metadata) {
    if (!text.empty() && text.front() == '{') {
      root[key] = ttsdf::parseJson(text, "metadata '" + key + "'");
    } else {
      root[key] = text;
    }
  }
  return root;
}

Json::Value describe(const ttsdf::FrameAgreement& agreement) {
  if (!agreement.known()) return Json::Value();
  Json::Value root;
  root["frames_compared"] = agreement.compared;
  root["frames_contradicting"] = agreement.contradicting;
  root["frames_without_overlap"] = agreement.without_overlap;
  root["position_median_m"] = agreement.position_median;
  root["position_90_m"] = agreement.position_90;
  root["rotation_median_rad"] = agreement.rotation_median;
  root["rotation_90_rad"] = agreement.rotation_90;
  root["widening"] = agreement.widening;
  root["shift_sigma_m"] = agreement.shift;
  root["turn_sensor_sigma_rad"] = agreement.turn_sensor;
  root["turn_scene_sigma_rad"] = agreement.turn_scene;
  root["viewpoints"] = Json::arrayValue;
  for (const ttsdf::ViewpointAgreement& known : agreement.viewpoints) {
    Json::Value one;
    for (const double x : known.viewpoint.position) one["position_m"].append(x);
    for (const double x : known.viewpoint.view) one["view"].append(x);
    one["frames"] = known.frames;
    one["variance_ratio"] = known.ratio;
    root["viewpoints"].append(one);
  }
  return root;
}

/// What the map takes once it is prepared for registration.
Json::Value memory(const ttsdf::TtSdfMap& map, double megabytes) {
  ttsdf::TtFieldOptions options;
  options.memory_megabytes = megabytes;
  const auto field = ttsdf::makeField(map, options);
  const auto far = ttsdf::makeLongRangeField(*field);
  field->warmUp();
  return ttsdf::memoryByPart(*field, far.get());
}

Json::Value describe(const ttsdf::TtSdfMap& map, const ttsdf::MapFileInfo& file, bool spectra) {
  Json::Value root;
  const auto& geometry = map.geometry;
  root["dims"] = toJson(geometry.dims.cast<double>().matrix());
  root["ranks"] = toJson(Eigen::Vector2d(map.train.rank1(), map.train.rank2()));
  for (auto& number : root["dims"]) number = number.asInt();
  for (auto& number : root["ranks"]) number = number.asInt();
  root["axes"] = Json::arrayValue;
  for (const int axis : map.train.axes()) root["axes"].append(std::string(1, "xyz"[axis]));
  root["voxel_size"] = geometry.voxel_size;
  root["origin"] = toJson(geometry.T_map_grid.translation());
  root["rotation_xyzw"] = toJson(Eigen::Quaterniond(geometry.T_map_grid.linear()).coeffs());
  root["frame_id"] = map.frame_id;
  root["field"] = ttsdf::name(map.kind);
  root["truncation"] = map.truncation;
  root["clamp_negative"] = map.clamp_negative;
  root["clamp_positive"] = map.clamp_positive;
  root["encoding"] = ttsdf::name(file.encoding);
  root["file_bytes"] = static_cast<Json::UInt64>(file.file_bytes);
  root["dense_bytes"] = static_cast<Json::UInt64>(geometry.voxelCount() * sizeof(float));
  root["supported_share"] = map.mask.empty() ? 1.0 : map.mask.supportedShare();
  root["map_id"] = file.map_id;
  root["frame_agreement"] = describe(map.agreement);
  root["metadata"] = metadata(map);
  const auto& nested = root["metadata"];
  root["build_report"] =
      nested.isMember("build_report") ? nested["build_report"] : Json::Value(Json::objectValue);
  root["metadata"].removeMember("build_report");
  if (spectra) {
    const auto values = ttsdf::spectra(map.train);
    root["spectrum1"] = toJson(values.first);
    root["spectrum2"] = toJson(values.second);
  }
  return root;
}

std::string plainText(const Json::Value& value) {
  if (value.isString()) return value.asString();
  std::string text;
  if (value.isArray()) {
    for (const auto& item : value) text += (text.empty() ? "" : " ") + plainText(item);
    return text;
  }
  text = ttsdf::toText(value);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

void printPlain(const Json::Value& root, const std::string& indent = "") {
  for (const auto& key : root.getMemberNames()) {
    const auto& value = root[key];
    if (value.isObject()) {
      if (value.empty()) continue;
      std::cout << indent << ttsdf::printable(key) << ":\n";
      printPlain(value, indent + "  ");
    } else {
      std::cout << indent << ttsdf::printable(key) << ": " << ttsdf::printable(plainText(value)) << '\n';
    }
  }
}

std::string agreementSentence(const ttsdf::FrameAgreement& agreement) {
  if (!agreement.known()) return "how far the frames of this map agree is unknown";
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "the frames of this map agree to "
       << 1e3 * agreement.position_median << " mm / " << 1e3 * agreement.rotation_median << " mrad";
  return text.str();
}

// The script lies beside the installed program, or in the source tree.
std::string plotScript() {
  namespace fs = std::filesystem;
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& folder : {here, fs::path(TTSDF_SCRIPTS_DIR)}) {
    if (fs::exists(folder / kPlotScript)) return (folder / kPlotScript).string();
  }
  throw std::runtime_error(std::string("plot: got no script '") + kPlotScript + "' in '" + here.string() +
                           "' or '" + TTSDF_SCRIPTS_DIR + "'");
}

[[noreturn]] void plot(const std::string& map_path, const std::string& picture) {
  const std::string script = plotScript();
  const std::string tools = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  const char* const arguments[] = {script.c_str(), map_path.c_str(), "--output", picture.c_str(),
                                   "--tools",      tools.c_str(),    nullptr};
  std::cout.flush();
  execv(script.c_str(), const_cast<char* const*>(arguments));
  throw std::runtime_error("plot: cannot run '" + script + "'");
}

int run(int argc, char** argv) {
  std::string map_path, picture;
  bool json = false, spectra = false;
  double memory_megabytes = ttsdf::TtFieldOptions().memory_megabytes;
  ttsdf::CommandLine line("ttsdf_info", "MAP.ttsdf [--json] [--plot FILE.png]", "Says what a map holds.");
  line.positional("MAP.ttsdf", map_path)
      .flag("json", json, "Prints one JSON object.")
      .flag("spectra", spectra, "Also the singular values between the cores.")
      .value("memory-megabytes", "N", memory_megabytes, "Bound on what the map takes in memory.")
      .value("plot", "FILE.png", picture, "Draws slices, surface and spectra (needs python3-matplotlib).");
  if (!line.parse(argc, argv, std::cout)) return 0;
  std::optional<ttsdf::Progress> progress(std::in_place, "ttsdf_info");  // a few bytes can hold a huge mask
  const auto map = ttsdf::loadMap(map_path);                             // its errors name the file
  const auto bytes = ttsdf::readFile(map_path);
  auto root = describe(map, ttsdf::fileInfo(bytes.data(), bytes.size()), spectra);
  root["memory"] = memory(map, memory_megabytes);
  root["memory_bytes"] = root["memory"]["map_memory_bytes"];
  progress.reset();
  if (json) {
    std::cout << ttsdf::toText(root);
  } else {
    printPlain(root);
    std::cout << agreementSentence(map.agreement) << '\n';
  }
  if (!std::cout.flush()) throw std::runtime_error("standard output: cannot write");
  if (!picture.empty()) plot(map_path, picture);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_info", [&] { return run(argc, argv); });
}
