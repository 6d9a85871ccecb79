// Values and gradients of a map at points of the map frame.

#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>

#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

Eigen::Matrix3Xd readPoints(std::istream& in, const std::string& name) {
  std::vector<double> numbers;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::istringstream words(line);
    double x = 0.0, y = 0.0, z = 0.0;
    std::string rest;
    if (!(words >> x >> y >> z) || words >> rest) {
      throw std::runtime_error("points '" + name + "', line " + std::to_string(number) + ": got '" + line +
                               "', wanted: x y z");
    }
    numbers.insert(numbers.end(), {x, y, z});
  }
  return Eigen::Map<Eigen::Matrix3Xd>(numbers.data(), 3, static_cast<Eigen::Index>(numbers.size() / 3));
}

// Each with word of its own: points may come from a keyboard.
std::shared_ptr<const ttsdf::DistanceField> loadField(const std::string& path,
                                                      const ttsdf::TtFieldOptions& options) {
  ttsdf::Progress progress("ttsdf_query");
  return ttsdf::makeField(ttsdf::loadMap(path), options);
}

ttsdf::FieldSamples evaluate(const ttsdf::DistanceField& field, const Eigen::Matrix3Xd& points) {
  ttsdf::Progress progress("ttsdf_query");
  progress.update("distances", 0.0);
  return field.evaluate((points.colwise() - field.geometry().origin).cast<float>().eval());
}

int run(int argc, char** argv) {
  std::string map_path, points_path, interpolation = "trilinear";
  ttsdf::CommandLine line(
      "ttsdf_query", "MAP.ttsdf --points FILE.txt [--interpolation nearest|trilinear]",
      "Per line `x y z` of the map frame [m]: prints `value gx gy gz valid`. `valid` is 0 outside the "
      "map and where the map knows nothing.");
  line.positional("MAP.ttsdf", map_path)
      .value("points", "FILE.txt", points_path, "The points; '-' reads them from the standard input.")
      .value("interpolation", "KIND", interpolation, "trilinear | nearest");
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (points_path.empty()) throw ttsdf::UsageError("--points is missing");
  ttsdf::TtFieldOptions options;
  try {
    options.interpolation = ttsdf::interpolationFromName(interpolation);
  } catch (const std::invalid_argument& error) {
    throw ttsdf::UsageError(error.what());
  }

  const auto field = loadField(map_path, options);
  Eigen::Matrix3Xd points;
  if (points_path == "-") {
    points = readPoints(std::cin, "standard input");
  } else {
    std::ifstream in(points_path);
    if (!in) throw std::runtime_error("points '" + points_path + "': cannot read");
    points = readPoints(in, points_path);
  }
  const auto samples = evaluate(*field, points);
  std::cout << std::setprecision(9);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const bool valid = samples.states[static_cast<std::size_t>(n)] == ttsdf::PointState::kValid;
    std::cout << samples.values[n] << ' ' << samples.gradients(0, n) << ' ' << samples.gradients(1, n) << ' '
              << samples.gradients(2, n) << ' ' << (valid ? 1 : 0) << '\n';
  }
  if (!std::cout.flush()) throw std::runtime_error("standard output: cannot write");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_query", [&] { return run(argc, argv); });
}
