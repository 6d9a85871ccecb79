#include "ttsdf_localization/evaluation/method_factory.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/field/derivative_core_field.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

namespace {

const std::vector<std::string> kFieldKinds{"track", "search", "global", "paper"};
const std::vector<std::string> kCloudKinds{"icp", "icp_plane", "gicp", "ndt"};
const std::vector<std::string> kOpen3dKinds{"open3d_icp", "open3d_icp_plane", "fgr", "ransac"};

bool isOneOf(const std::vector<std::string>& kinds, const std::string& kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

bool parseBool(const std::string& key, const std::string& text) {
  if (text == "true") return true;
  if (text == "false") return false;
  throw std::invalid_argument("method setting '" + key + "': got '" + text + "', wanted true or false");
}

}  // namespace

MethodSpec parseMethodSpec(const std::string& text) {
  MethodSpec spec;
  const std::string head = text.substr(0, text.find(':'));
  const auto equals = head.find('=');
  spec.kind = equals == std::string::npos ? head : head.substr(equals + 1);
  spec.label = equals == std::string::npos ? text : head.substr(0, equals);
  std::replace(spec.label.begin(), spec.label.end(), ',', ' ');
  if (spec.kind != "prior" && !isOneOf(kFieldKinds, spec.kind) && !isOneOf(kCloudKinds, spec.kind) &&
      !isOneOf(kOpen3dKinds, spec.kind)) {
    throw std::invalid_argument("method '" + text + "': got kind '" + spec.kind +
                                "', wanted one of prior, track, search, global, paper, icp, icp_plane, gicp, "
                                "ndt, open3d_icp, open3d_icp_plane, fgr, ransac");
  }
  if (head.size() == text.size()) return spec;
  std::stringstream settings(text.substr(head.size() + 1));
  for (std::string setting; std::getline(settings, setting, ',');) {
    const auto split = setting.find('=');
    if (split == std::string::npos) {
      throw std::invalid_argument("method '" + text + "': got '" + setting + "', wanted key=value");
    }
    spec.settings.emplace_back(setting.substr(0, split), setting.substr(split + 1));
  }
  return spec;
}

std::unique_ptr<Method> MethodFactory::make(const MethodSpec& spec) {
  if (isOneOf(kFieldKinds, spec.kind)) return makeFieldMethod(spec);
  if (isOneOf(kCloudKinds, spec.kind) || isOneOf(kOpen3dKinds, spec.kind)) return makeCloudMethodFrom(spec);
  if (!spec.settings.empty()) throw std::invalid_argument("method 'prior': got settings, wanted none");
  return makePriorMethod();
}

std::unique_ptr<Method> MethodFactory::makeFieldMethod(const MethodSpec& spec) {
  std::string map = defaults_.map;
  Interpolation interpolation = Interpolation::kTrilinear;
  if (spec.kind == "paper") interpolation = Interpolation::kNearest;
  bool dense = false;
  bool cores = false;
  PaperMethodOptions paper;
  auto registration = defaults_.registration;
  auto search = defaults_.search;
  auto global = defaults_.global;
  for (const auto& [key, value] : spec.settings) {
    if (key == "map") {
      map = value;
    } else if (key == "interpolation") {
      interpolation = interpolationFromName(value);
    } else if (key == "dense") {
      dense = parseBool(key, value);
    } else if (spec.kind == "paper" && key == "cores") {
      cores = parseBool(key, value);
    } else if (spec.kind == "paper") {
      paperMethodOptionTable().setFromText(paper, key, value);
    } else if (spec.kind == "search" && searchOptionTable().has(key)) {
      searchOptionTable().setFromText(search, key, value);
    } else if (spec.kind == "global" && globalOptionTable().has(key)) {
      globalOptionTable().setFromText(global, key, value);
    } else {
      registrationOptionTable().setFromText(registration, key, value);
    }
  }
  if (map.empty())
    throw std::invalid_argument("method '" + spec.label + "': got no map, wanted --map or map=FILE");
  const TtSdfMap loaded = loadMap(map);
  if (cores) {
    return makePaperMethod(
        std::make_shared<DerivativeCoreField>(loaded.train, relativeToOrigin(loaded.geometry), loaded.mask),
        paper);
  }
  const auto field = makeEvaluationField(loaded, interpolation, dense);
  if (spec.kind == "paper") return makePaperMethod(field, paper);
  if (spec.kind == "search") return makeSearchMethod(field, registration, search);
  if (spec.kind == "global") return makeGlobalMethod(field, registration, global, defaults_.map_down);
  return makeTrackMethod(field, registration);
}

std::unique_ptr<Method> MethodFactory::makeCloudMethodFrom(const MethodSpec& spec) {
  auto options = defaults_.cloud;
  for (const auto& [key, value] : spec.settings) cloudMethodOptionTable().setFromText(options, key, value);
  if (!map_cloud_) {
    if (!defaults_.map_cloud)
      throw std::invalid_argument("method '" + spec.label + "': got no point cloud map");
    map_cloud_ = std::make_unique<MapCloud>(defaults_.map_cloud());
  }
  if (isOneOf(kOpen3dKinds, spec.kind)) return makeOpen3dMethod(spec.kind, *map_cloud_, options);
  return makeCloudMethod(spec.kind, map_cloud_->points, options);
}

}  // namespace ttsdf
