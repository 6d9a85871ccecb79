#include "ttsdf_localization/frames/pinhole.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ttsdf {

namespace {

constexpr double kTolerancePixels = 0.1;
/// 65535 mm: "no reading" of 16-bit depth images, which depth_image_proc takes for a distance.
constexpr float kNoDepth = 65535 * 0.001F;
constexpr Eigen::Index kMinRays = 100;
constexpr double kMinSpread = 0.1;  // share of the image's width and height that the points must span

/// Least squares line slope * pixel + offset through (pixel, ray coordinate), fitted around the mean pixel.
class LineFit {
 public:
  explicit LineFit(double centre) : centre_(centre) {}
  void add(int pixel, double ray) {
    const double p = pixel - centre_;
    n_ += 1.0, sp_ += p, sr_ += ray, spp_ += p * p, spr_ += p * ray;
    low_ = std::min(low_, pixel), high_ = std::max(high_, pixel);
  }
  int span() const { return high_ - low_ + 1; }
  /// ray = (pixel - principal) / focal. False if the points do not tell.
  bool solve(double* focal, double* principal) const {
    const double determinant = n_ * spp_ - sp_ * sp_;
    if (!(determinant > 0.0)) return false;
    const double slope = (n_ * spr_ - sp_ * sr_) / determinant;
    const double offset = (sr_ - slope * sp_) / n_;
    *focal = 1.0 / slope;
    *principal = centre_ - offset / slope;
    return std::isfinite(*focal) && std::isfinite(*principal);
  }

 private:
  double centre_;
  double n_ = 0.0, sp_ = 0.0, sr_ = 0.0, spp_ = 0.0, spr_ = 0.0;
  int low_ = std::numeric_limits<int>::max(), high_ = std::numeric_limits<int>::min();
};

bool fitIntrinsics(const Eigen::Matrix3Xf& points, CameraIntrinsics* k) {
  LineFit columns(0.5 * k->width), rows(0.5 * k->height);
  Eigen::Index used = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i).cast<double>();
    if (!p.allFinite()) continue;
    if (p.z() <= 0.0) return false;
    columns.add(static_cast<int>(i % k->width), p.x() / p.z());
    rows.add(static_cast<int>(i / k->width), p.y() / p.z());
    ++used;
  }
  return used >= kMinRays && columns.span() >= kMinSpread * k->width &&
         rows.span() >= kMinSpread * k->height && columns.solve(&k->fx, &k->cx) && rows.solve(&k->fy, &k->cy);
}

bool agrees(const Eigen::Vector3d& p, int u, int v, const CameraIntrinsics& k) {
  return std::abs(k.fx * p.x() / p.z() + k.cx - u) <= kTolerancePixels &&
         std::abs(k.fy * p.y() / p.z() + k.cy - v) <= kTolerancePixels;
}

}  // namespace

std::optional<std::pair<DepthImage, CameraIntrinsics>> pinholeFromCloud(const Eigen::Matrix3Xf& points,
                                                                        int width, int height) {
  if (width < 2 || height < 2 || static_cast<Eigen::Index>(width) * height != points.cols())
    return std::nullopt;
  CameraIntrinsics k;
  k.width = width, k.height = height;
  if (!fitIntrinsics(points, &k)) return std::nullopt;

  DepthImage image;
  image.width = width, image.height = height;
  image.depth.assign(static_cast<std::size_t>(points.cols()), 0.0F);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i).cast<double>();
    if (!p.allFinite()) continue;
    if (!agrees(p, static_cast<int>(i % width), static_cast<int>(i / width), k)) return std::nullopt;
    if (points(2, i) != kNoDepth) image.depth[static_cast<std::size_t>(i)] = points(2, i);
  }
  return std::make_pair(std::move(image), k);
}

}  // namespace ttsdf
