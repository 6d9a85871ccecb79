#include "ttsdf_localization/exports/occupancy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

constexpr double kLeastResolution = 0.02;  // [m]
constexpr double kMostCells = 1e8;

Eigen::AlignedBox3d boxOf(const GridGeometry& geometry) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    box.extend(geometry.samplePosition((bits * (geometry.dims - 1)).cast<double>().matrix()));
  }
  return box;
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
  const Eigen::Array2d cells = ((box.max() - box.min()).head<2>().array() / image.resolution).ceil().max(1.0);
  if (cells.prod() > kMostCells) {
    throw std::invalid_argument("occupancy: got a resolution of " + std::to_string(image.resolution) +
                                " m, which makes more than 10^8 cells");
  }
  image.width = static_cast<int>(cells[0]), image.height = static_cast<int>(cells[1]);
  image.origin = {box.min().x(), box.min().y(), 0.0};
  image.cells.assign(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                     OccupancyImage::kUnknown);

  const int layers = std::max(1, static_cast<int>(std::floor((high - low) / voxel)) + 1);
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

void writeOccupancy(const OccupancyImage& image, const std::string& name) {
  const std::string stem =
      name.size() > 4 && (name.rfind(".pgm") == name.size() - 4)    ? name.substr(0, name.size() - 4)
      : name.size() > 5 && (name.rfind(".yaml") == name.size() - 5) ? name.substr(0, name.size() - 5)
                                                                    : name;
  constexpr char kFreeGrey = static_cast<char>(254), kUnknownGrey = static_cast<char>(205), kOccupiedGrey = 0;
  std::ofstream picture(stem + ".pgm", std::ios::binary);
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
  std::ofstream yaml(stem + ".yaml");
  yaml << std::setprecision(std::numeric_limits<double>::max_digits10)
       << "image: " << std::filesystem::path(stem).filename().string()
       << ".pgm\nresolution: " << image.resolution << "\norigin: [" << image.origin.x() << ", "
       << image.origin.y() << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  if (!picture.flush() || !yaml.flush())
    throw std::runtime_error("occupancy '" + stem + "': cannot be written");
}

}  // namespace ttsdf
