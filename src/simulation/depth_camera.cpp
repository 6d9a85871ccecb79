#include "ttsdf_localization/simulation/depth_camera.h"

#include <stdexcept>
#include <thread>

#include "depth_renderer.h"
#include "row_noise.h"

namespace ttsdf {

const OptionTable<DepthCameraOptions>& depthCameraOptionTable() {
  using O = DepthCameraOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("width", &O::width, 1, 8192, "pixel", "Width of the image.")
          .add("height", &O::height, 1, 8192, "pixel", "Height of the image.")
          .add("fx", &O::fx, 1.0, 100000.0, "pixel", "Horizontal focal length.")
          .add("fy", &O::fy, 1.0, 100000.0, "pixel", "Vertical focal length.")
          .add("min_range", &O::min_range, 0.0, 100.0, "m", "Nearest depth that gives a reading.")
          .add("max_range", &O::max_range, 0.1, 1000.0, "m", "Farthest depth that gives a reading.")
          .add("threads", &O::threads, 1, 64, "", "Threads that render one image.")
          .add(&O::noise, depthNoiseOptionTable());
  return kTable;
}

DepthCamera::DepthCamera(const DepthCameraOptions& options) : options_(options) {
  depthCameraOptionTable().validate(options);
  if (options.max_range <= options.min_range) {
    throw std::invalid_argument("depth camera: got max_range not above min_range, wanted a range");
  }
  intrinsics_ = {options.width,
                 options.height,
                 options.fx,
                 options.fy,
                 0.5 * (options.width - 1),
                 0.5 * (options.height - 1)};
}

DepthImage DepthCamera::render(const AnalyticScene& scene, const Eigen::Isometry3d& T_map_camera,
                               std::uint64_t frame, const std::vector<Solid>& clutter) const {
  if (!T_map_camera.matrix().allFinite()) {
    throw std::invalid_argument("render: got a camera pose that is not finite, wanted a rigid motion");
  }
  std::vector<const Solid*> solids;
  for (const Solid& solid : scene.solids()) solids.push_back(&solid);
  for (const Solid& solid : clutter) solids.push_back(&solid);
  const std::vector<VisibleSolid> visible =
      visibleSolids(solids, intrinsics_, T_map_camera, options_.max_range);

  DepthImage image;
  image.width = options_.width;
  image.height = options_.height;
  image.depth.assign(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height), 0.0f);
  // Rows are dealt out in turn: the floor costs more than the ceiling.
  const auto share = [&](int first) {
    RowBuffer row;
    for (int v = first; v < image.height; v += options_.threads) {
      renderRow(visible, intrinsics_, v, row);
      readRow(visible, row, v, frame, image);
    }
  };
  std::vector<std::thread> helpers;
  for (int i = 1; i < options_.threads; ++i) helpers.emplace_back(share, i);
  share(0);
  for (auto& helper : helpers) helper.join();
  return image;
}

void DepthCamera::readRow(const std::vector<VisibleSolid>& visible, const RowBuffer& row, int v,
                          std::uint64_t frame, DepthImage& image) const {
  RowNoise noise(options_.noise, options_.fx, frame, v);
  float* out = &image.depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width)];
  for (std::size_t u = 0; u < row.depth.size(); ++u) {
    if (row.index[u] < 0.0) continue;
    const double depth = row.depth[u];
    const auto cosine = [&] {
      return incidenceCosine(visible[static_cast<std::size_t>(row.index[u])], intrinsics_,
                             static_cast<int>(u), v, depth);
    };
    if (!noise.returns(atDepthEdge(row.depth.data(), row.depth.size(), u), cosine)) continue;
    const double reading = noise.measure(depth);
    if (reading >= options_.min_range && reading <= options_.max_range) out[u] = static_cast<float>(reading);
  }
}

}  // namespace ttsdf
