#include "ros/poses/pose_store.h"

#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "ttsdf_localization/localization/pose_covariance.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

namespace {
constexpr const char* kTitle = "ttsdf_localization_pose";
}

void savePose(const std::string& path, const std::string& frame_id, const PoseGuess& pose) {
  std::ostringstream out;
  out << kTitle << " 1\n"
      << frame_id << '\n'
      << std::setprecision(17) << pose.T_map_base.matrix() << '\n'
      << pose.covariance << '\n';
  const std::string text = out.str();
  writeFileAtomically(path, std::vector<std::uint8_t>(text.begin(), text.end()), {"a saved pose", kTitle});
}

std::optional<PoseGuess> loadPose(const std::string& path, const std::string& frame_id) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::string title, version, frame;
  Eigen::Matrix4d matrix;
  PoseGuess pose;
  file >> title >> version >> frame;
  for (Eigen::Index n = 0; n < 16; ++n) file >> matrix(n / 4, n % 4);
  for (Eigen::Index n = 0; n < 36; ++n) file >> pose.covariance(n / 6, n % 6);
  if (!file || title != kTitle || version != "1") {
    throw std::runtime_error("pose file '" + path + "': got something else than a saved pose");
  }
  if (frame != frame_id) {
    throw std::runtime_error("pose file '" + path + "': got a pose in frame '" + frame + "', wanted '" +
                             frame_id + "'");
  }
  try {
    pose.T_map_base = orthonormalized(matrix);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("pose file '" + path + "': " + error.what());
  }
  if (!isCovariance(pose.covariance))
    throw std::runtime_error("pose file '" + path + "': the covariance is none");
  pose.source = "saved pose";
  return pose;
}

}  // namespace ttsdf
