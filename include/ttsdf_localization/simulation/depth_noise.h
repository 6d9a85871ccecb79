#pragma once
// What a real depth sensor makes of a true depth: noise that grows with range, quantised disparities, holes.

#include <string>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct DepthNoiseOptions {
  double noise_base = 0.0;       ///< sigma(z) = noise_base + noise_quadratic z^2 [m]
  double noise_quadratic = 0.0;  ///< [1/m]
  double disparity_step = 0.0;   ///< quantisation of the disparity [pixel]; 0: none
  double baseline = 0.075;       ///< between the sensor's two eyes [m], for the disparity
  double dropout = 0.0;          ///< share of pixels lost at random
  double grazing_angle = 0.0;    ///< surfaces seen at less than this angle give no reading [rad]; 0: all do
  double edge_dropout = 0.0;     ///< share of pixels lost at depth discontinuities
  int noise_seed = 1;
};

const OptionTable<DepthNoiseOptions>& depthNoiseOptionTable();

/// Structured light as the first Kinect: sigma after Khoshelham and Elberink (2012), 1/8 pixel disparity
/// steps.
DepthNoiseOptions kinectNoise();
/// Active stereo as the RealSense D435: 0.08 pixel disparity noise on a 50 mm baseline, more holes at edges.
DepthNoiseOptions realsenseNoise();
/// "none", "kinect", "realsense"; throws std::invalid_argument for another name.
DepthNoiseOptions depthNoise(const std::string& preset);

}  // namespace ttsdf
