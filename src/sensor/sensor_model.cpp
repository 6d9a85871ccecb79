#include "ttsdf_localization/sensor/sensor_model.h"

#include <algorithm>
#include <stdexcept>

namespace ttsdf {

namespace {

struct Preset {
  const char* name;
  SensorModel model;  // noise, linear, quadratic, grazing angle, mixes edges
};

const Preset kPresets[] = {
    {"kinect", {0.0005, 0.0, 0.001425, 0.14, true}}, {"realsense_d435", {0.001, 0.0, 0.0025, 0.2, true}},
    {"orbbec", {0.001, 0.0, 0.002, 0.17, true}},     {"time_of_flight", {0.003, 0.0015, 0.0, 0.14, true}},
    {"lidar", {0.015, 0.0002, 0.0, 0.05, false}},    {"exact", {}},
};

}  // namespace

const std::vector<std::string>& sensorNames() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Preset& preset : kPresets) names.emplace_back(preset.name);
    return names;
  }();
  return kNames;
}

SensorModel sensorModel(const std::string& name) {
  std::string all;
  for (const Preset& preset : kPresets) {
    if (name == preset.name) return preset.model;
    all += std::string(all.empty() ? "" : " | ") + preset.name;
  }
  throw std::invalid_argument("sensor: got '" + name + "', wanted " + all);
}

}  // namespace ttsdf
