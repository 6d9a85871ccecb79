#include "ttsdf_localization/exports/occupancy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "export_file.h"

namespace ttsdf {

namespace {

constexpr double kLeastResolution = 0.02;               // [m]
constexpr double kMostCells = 1e8, kMostSamples = 2e9;  // these are cells times layers

Eigen::Array2d cellsOf(const Eigen::AlignedBox3d& box, double resolution) {
  return ((box.max() - box.min()).head<2>().array() / resolution).ceil().max(1.0);
}

void checkResolution(const Eigen::AlignedBox3d& box, double resolution, double voxel, int layers) {
  const Eigen::Vector2d extent = box.sizes().head<2>();
  const double most = std::max(extent.maxCoeff(), voxel), cells = cellsOf(box, resolution).prod();
  const bool too_many = cells > kMostCells || (cells * layers > kMostSamples && resolution < 0.99 * voxel);
  if (resolution <= most * (1.0 + 1e-9) && !too_many) return;
  const double finest =
      std::sqrt(extent.cwiseMax(voxel).prod() * std::max(1.0 / kMostCells, layers / kMostSamples));
  std::ostringstream text;
  text << "occupancy: got a resolution of " << resolution << " m, which makes " << cells << " cells in "
       << layers << " layers, wanted " << finest << " to " << most << " m";
  throw std::invalid_argument(text.str());
}

/// As a text of YAML in single quotes.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

}  // namespace

OccupancyImage occupancyOf(const TtSdfMap& map, const OccupancyOptions& options) {
  const auto field = makeField(map);
  const Eigen::AlignedBox3d box = boxOf(map.geometry);
  const double voxel = map.geometry.voxel_size;
  OccupancyImage image;
  image.resolution = options.resolution > 0.0 ? options.resolution : std::max(voxel, kLeastResolution);
  const double low = std::max(options.min_height, box.min().z()),
               high = std::min(options.max_height, box.max().z());
  if (!(options.resolution >= 0.0 && std::isfinite(options.resolution)) || !(low <= high)) {
    std::ostringstream text;
    text << "occupancy: got resolution " << options.resolution << " m and heights from " << options.min_height
         << " to " << options.max_height << " m, wanted a positive resolution and heights within "
         << box.min().z() << " to " << box.max().z() << " m";
    throw std::invalid_argument(text.str());
  }
  const int layers = std::max(1, static_cast<int>(std::floor((high - low) / voxel)) + 1);
  checkResolution(box, image.resolution, voxel, layers);
  const Eigen::Array2d cells = cellsOf(box, image.resolution);
  image.width = static_cast<int>(cells[0]), image.height = static_cast<int>(cells[1]);
  image.origin = {box.min().x(), box.min().y(), 0.0};
  image.cells.assign(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                     OccupancyImage::kUnknown);

  // Half the diagonal of a cell at the most: a surface between samples is not missed.
  const auto reach = static_cast<float>(0.5 * std::max(voxel, image.resolution));
  Eigen::Matrix3Xf points(3, image.width);
  for (int layer = 0; layer < layers; ++layer) {
    const double z = std::min(high, low + layer * voxel);
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        const Eigen::Vector3d p(image.origin.x() + (column + 0.5) * image.resolution,
                                image.origin.y() + (row + 0.5) * image.resolution, z);
        points.col(column) = (p - field->geometry().origin).cast<float>();
      }
      const FieldSamples samples = field->evaluate(points);
      std::int8_t* cell = image.cells.data() + static_cast<std::ptrdiff_t>(row) * image.width;
      for (int column = 0; column < image.width; ++column) {
        if (samples.states[static_cast<std::size_t>(column)] != PointState::kValid) continue;
        if (samples.values[column] <= reach) {
          cell[column] = OccupancyImage::kOccupied;
        } else if (cell[column] == OccupancyImage::kUnknown) {
          cell[column] = OccupancyImage::kFree;
        }
      }
    }
  }
  return image;
}

OccupancyFiles occupancyFiles(const std::string& name) {
  std::string stem = name;
  for (const std::string ending : {".pgm", ".yaml"}) {
    if (name.size() > ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0)
      stem = name.substr(0, name.size() - ending.size());
  }
  return {stem + ".pgm", stem + ".yaml"};
}

void writeOccupancy(const OccupancyImage& image, const std::string& name) {
  const OccupancyFiles files = occupancyFiles(name);
  constexpr char kFreeGrey = static_cast<char>(254), kUnknownGrey = static_cast<char>(205), kOccupiedGrey = 0;
  std::ostringstream picture;
  picture << "P5\n" << image.width << ' ' << image.height << "\n255\n";
  for (int row = image.height - 1; row >= 0; --row) {  // pictures begin at the top
    std::string line;
    for (int column = 0; column < image.width; ++column) {
      const std::int8_t cell =
          image.cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(column)];
      line += cell == OccupancyImage::kUnknown ? kUnknownGrey
              : cell == OccupancyImage::kFree  ? kFreeGrey
                                               : kOccupiedGrey;
    }
    picture.write(line.data(), static_cast<std::streamsize>(line.size()));
  }
  std::ostringstream yaml;
  yaml << std::setprecision(std::numeric_limits<double>::max_digits10)
       << "image: " << quoted(std::filesystem::path(files.image).filename().string())
       << "\nresolution: " << image.resolution << "\norigin: [" << image.origin.x() << ", "
       << image.origin.y() << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  writeExport(files.image, picture.str());
  writeExport(files.yaml, yaml.str());
}

}  // namespace ttsdf
