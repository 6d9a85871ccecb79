#include "ttsdf_localization/simulation/depth_noise.h"

#include <cmath>
#include <stdexcept>

#include "row_noise.h"

namespace ttsdf {

namespace {

SplitMix rowStream(int seed, std::uint64_t frame, int row) {
  SplitMix of_seed(static_cast<std::uint64_t>(seed));
  SplitMix of_frame(of_seed() ^ frame);
  return SplitMix(of_frame() ^ static_cast<std::uint64_t>(row));
}

}  // namespace

const OptionTable<DepthNoiseOptions>& depthNoiseOptionTable() {
  using O = DepthNoiseOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("noise_base", &O::noise_base, 0.0, 1.0, "m", "Constant part of the depth noise's sigma.")
          .add("noise_quadratic", &O::noise_quadratic, 0.0, 1.0, "1/m",
               "Part that grows with the squared depth.")
          .add("disparity_step", &O::disparity_step, 0.0, 8.0, "pixel",
               "Quantisation of the disparity; 0: none.")
          .add("baseline", &O::baseline, 0.001, 1.0, "m", "Distance between the sensor's eyes.")
          .add("dropout", &O::dropout, 0.0, 1.0, "", "Share of pixels without a reading, at random.")
          .add("grazing_angle", &O::grazing_angle, 0.0, 1.5, "rad",
               "Flatter views of a surface give no reading.")
          .add("edge_dropout", &O::edge_dropout, 0.0, 1.0, "",
               "Share of pixels lost at depth discontinuities.")
          .add("noise_seed", &O::noise_seed, 0, 1000000000, "", "Seed of the depth noise.");
  return kTable;
}

DepthNoiseOptions kinectNoise() {
  DepthNoiseOptions noise;
  noise.noise_base = 0.0005;
  noise.noise_quadratic = 0.001425;
  noise.disparity_step = 0.125;
  noise.dropout = 0.005;
  noise.grazing_angle = 0.14;
  noise.edge_dropout = 0.5;
  return noise;
}

DepthNoiseOptions realsenseNoise() {
  DepthNoiseOptions noise;
  noise.noise_base = 0.001;
  noise.noise_quadratic = 0.0025;
  noise.baseline = 0.05;
  noise.dropout = 0.02;
  noise.grazing_angle = 0.2;
  noise.edge_dropout = 0.8;
  return noise;
}

DepthNoiseOptions depthNoise(const std::string& preset) {
  if (preset == "none") return {};
  if (preset == "kinect") return kinectNoise();
  if (preset == "realsense") return realsenseNoise();
  throw std::invalid_argument("depth noise: got '" + preset + "', wanted one of none kinect realsense");
}

RowNoise::RowNoise(const DepthNoiseOptions& options, double fx, std::uint64_t frame, int row)
    : options_(options),
      disparity_scale_(fx * options.baseline),
      grazing_cosine_(std::sin(options.grazing_angle)),
      random_(rowStream(options.noise_seed, frame, row)) {}

double RowNoise::measure(double depth) {
  const double sigma = options_.noise_base + options_.noise_quadratic * depth * depth;
  double z = depth;
  if (sigma > 0.0) z += sigma * normal_(random_);
  if (options_.disparity_step > 0.0 && z > 0.0) {
    const double steps = std::round(disparity_scale_ / (z * options_.disparity_step));
    z = steps > 0.0 ? disparity_scale_ / (steps * options_.disparity_step) : 0.0;
  }
  return z;
}

}  // namespace ttsdf
