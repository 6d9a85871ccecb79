#include "surface_pixels.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

#include "../../tensor/vectorize.h"
#include "ttsdf_localization/sensor/sensor_model.h"

namespace ttsdf {

namespace {

constexpr int kMaxReach = 2;  // half width of the window [pixel]
constexpr int kRun = 16;      // pixels of a row that are worked on together
/// Windows are at most about a voxel wide at this depth: wider ones would round creases that the volume can
/// show.
constexpr double kWindowDepth = 2.0;  // [m]
/// Neighbours lie on the same surface if their depth differs by no more than the slope of a surface seen at
/// kMaxSlope = tan(82 deg) plus so many sigmas of noise.
constexpr float kMaxSlope = 7.0F;
constexpr double kNoiseSigmas = 3.0;
constexpr double kLeastNoise = 0.0003;  // [m]: depth comes in steps of a millimetre
/// A pixel at a straight depth edge has about 0.6 of its neighbours on its own surface, inner ones have all.
constexpr float kEdgeShareNone = 0.5F, kEdgeShareFull = 0.9F;
constexpr double kLeastCosine = 0.05;       // flatter planes are not fitted well, whatever the sensor
constexpr float kFreeMinCosine = 0.1F;      // bounds the gap left in front of grazing surfaces
constexpr float kFreeNoPlaneMargin = 2.0F;  // gap in truncations in front of readings without a plane
constexpr float kMaxBehind =
    2.0F;  // how far the band may reach behind the surface along the ray [truncations]
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Inverse depth with a border of zeros (no reading) of kMaxReach pixels, and a run more at the rows' ends.
class InverseDepth {
 public:
  InverseDepth(const DepthImage& image, double min_depth)
      : stride_(static_cast<std::size_t>(image.width + 2 * kMaxReach + kRun)),
        values_(stride_ * static_cast<std::size_t>(image.height + 2 * kMaxReach), 0.0F) {
    const auto nearest = static_cast<float>(min_depth);
    tbb::parallel_for(tbb::blocked_range<int>(0, image.height), [&](const tbb::blocked_range<int>& rows) {
      for (int v = rows.begin(); v != rows.end(); ++v) {
        const float* depth =
            image.depth.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width);
        float* out = row(v);
        for (int u = 0; u < image.width; ++u) {
          out[u] = depth[u] >= nearest && depth[u] > 0.0F && depth[u] < kInfinity ? 1.0F / depth[u] : 0.0F;
        }
      }
    });
  }
  float* row(int v) { return values_.data() + static_cast<std::size_t>(v + kMaxReach) * stride_ + kMaxReach; }
  const float* row(int v) const { return const_cast<InverseDepth*>(this)->row(v); }

 private:
  std::size_t stride_;
  std::vector<float> values_;
};

/// Sums of the least squares fit of inverse depth over the window, for a run of pixels of one row.
struct RunSums {
  float n[kRun], x[kRun], y[kRun], xx[kRun], xy[kRun], yy[kRun], d[kRun], xd[kRun], yd[kRun];
};

/// Noise of inverse depth d, sigma(1 / d) d^2: a polynomial in d.
struct InverseNoise {
  explicit InverseNoise(const SensorModel& sensor)
      : constant(static_cast<float>(kNoiseSigmas * sensor.noise_quadratic)),
        linear(static_cast<float>(kNoiseSigmas * sensor.noise_linear)),
        square(static_cast<float>(kNoiseSigmas * std::max(sensor.noise, kLeastNoise))) {}
  float constant, linear, square;
};

/// Differences of inverse depth that neighbours one and two pixels away may have.
struct RunLimits {
  RunLimits(const float* centre, float slope, const InverseNoise& noise) {
    for (int step = 1; step <= kMaxReach; ++step) {
      for (int u = 0; u < kRun; ++u) {
        of[step][u] = (slope * static_cast<float>(step) + noise.linear) * centre[u] + noise.constant +
                      noise.square * centre[u] * centre[u];
      }
    }
    std::copy(std::begin(of[1]), std::end(of[1]), std::begin(of[0]));
  }
  float of[kMaxReach + 1][kRun];
};

inline std::int32_t bits(float value) {
  std::int32_t result;
  std::memcpy(&result, &value, sizeof(result));
  return result;
}
inline float number(std::int32_t pattern) {
  float result;
  std::memcpy(&result, &pattern, sizeof(result));
  return result;
}

/// rows: the inverse depths from two rows above the run to two below, at its first pixel. Sums stay in
/// registers while the window passes.
TTSDF_VECTORIZE void sumWindow(const float* const rows[2 * kMaxReach + 1], int reach, const RunLimits& limits,
                               RunSums& sums) {
  float n[kRun] = {}, x[kRun] = {}, y[kRun] = {}, xx[kRun] = {}, xy[kRun] = {}, yy[kRun] = {}, d[kRun] = {},
        xd[kRun] = {}, yd[kRun] = {};
  const float* const centre = rows[kMaxReach];
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const int step = dx * dx > dy * dy ? (dx < 0 ? -dx : dx) : (dy < 0 ? -dy : dy);
      const float* const neighbour = rows[kMaxReach + dy] + dx;
      const float* const limit = limits.of[step];
      const auto fx = static_cast<float>(dx), fy = static_cast<float>(dy);
      float m[kRun], md[kRun];
      // Masks from the sign bits: a comparison of floats may raise a flag and stays a branch.
      for (int u = 0; u < kRun; ++u) {
        const float difference = neighbour[u] - centre[u];
        const std::int32_t outside = bits(limit[u] - difference) | bits(limit[u] + difference);
        const auto none = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits(neighbour[u])) -
                                                    1u);  // no reading is zero, readings are positive
        const std::int32_t same = ~((outside | none) >> 31);
        m[u] = number(same & bits(1.0F));
        md[u] = number(same & bits(difference));
      }
      for (int u = 0; u < kRun; ++u) {
        n[u] += m[u], x[u] += m[u] * fx, y[u] += m[u] * fy;
        xx[u] += m[u] * (fx * fx), xy[u] += m[u] * (fx * fy), yy[u] += m[u] * (fy * fy);
        d[u] += md[u], xd[u] += md[u] * fx, yd[u] += md[u] * fy;
      }
    }
  }
  for (int u = 0; u < kRun; ++u) {
    sums.n[u] = n[u], sums.x[u] = x[u], sums.y[u] = y[u];
    sums.xx[u] = xx[u], sums.xy[u] = xy[u], sums.yy[u] = yy[u];
    sums.d[u] = d[u], sums.xd[u] = xd[u], sums.yd[u] = yd[u];
  }
}

/// Fitted inverse depth at the pixel relative to the reading, and its slopes per pixel.
struct Slope {
  float value = 0.0F, du = 0.0F, dv = 0.0F;
  bool good = false;
};

Slope solve(const RunSums& s, int u) {
  // Cramer's rule on [n x y; x xx xy; y xy yy]; the entries are small integers, so the determinant is exact.
  const float a = s.xx[u] * s.yy[u] - s.xy[u] * s.xy[u], b = s.y[u] * s.xy[u] - s.x[u] * s.yy[u],
              c = s.x[u] * s.xy[u] - s.y[u] * s.xx[u];
  const float determinant = s.n[u] * a + s.x[u] * b + s.y[u] * c;
  Slope slope;
  if (determinant < 1.0F) return slope;  // all neighbours on one line
  const float e = s.n[u] * s.yy[u] - s.y[u] * s.y[u], f = s.x[u] * s.y[u] - s.n[u] * s.xy[u],
              g = s.n[u] * s.xx[u] - s.x[u] * s.x[u];
  const float inverse = 1.0F / determinant;
  slope.value = (a * s.d[u] + b * s.xd[u] + c * s.yd[u]) * inverse;
  slope.du = (b * s.d[u] + e * s.xd[u] + f * s.yd[u]) * inverse;
  slope.dv = (c * s.d[u] + f * s.xd[u] + g * s.yd[u]) * inverse;
  slope.good = true;
  return slope;
}

/// Turns fits into pixels for one image; free depths are per pixel still.
class PixelMaker {
 public:
  PixelMaker(const CameraIntrinsics& k, const FusionOptions& options, int reach)
      : reach_(reach),
        width_(k.width),
        height_(k.height),
        fx_(static_cast<float>(k.fx)),
        fy_(static_cast<float>(k.fy)),
        cx_(static_cast<float>(k.cx)),
        cy_(static_cast<float>(k.cy)),
        truncation_(static_cast<float>(options.truncation)),
        max_depth_(static_cast<float>(options.max_depth)),
        sensor_(sensorModel(options.sensor)),
        least_cosine_(static_cast<float>(std::max(std::sin(sensor_.grazing_angle), kLeastCosine))),
        floor_(options.readingFloor()) {}

  /// `place`: of the pixel in the run.
  SurfacePixel make(int u, int v, float inverse_depth, const RunSums& sums, int place) const {
    SurfacePixel pixel;
    if (inverse_depth <= 0.0F) return pixel;
    const float depth = 1.0F / inverse_depth;
    pixel.free_depth = std::min(depth - kFreeNoPlaneMargin * truncation_, max_depth_);
    if (depth > max_depth_) return pixel;
    const Slope slope = solve(sums, place);
    const float share = (sums.n[place] - 1.0F) / static_cast<float>(span(u, width_) * span(v, height_) - 1);
    const float inner = std::clamp((share - kEdgeShareNone) / (kEdgeShareFull - kEdgeShareNone), 0.0F, 1.0F);
    const float edge = sensor_.mixes_edges ? inner : 1.0F;
    if (!slope.good || edge <= 0.0F) return pixel;
    setPlane(static_cast<float>(u) - cx_, static_cast<float>(v) - cy_, inverse_depth + slope.value, slope,
             edge, pixel);
    return pixel;
  }

 private:
  /// Pixels of the window along one axis that lie inside the image.
  int span(int pixel, int extent) const {
    return std::min(pixel, reach_) + 1 + std::min(extent - 1 - pixel, reach_);
  }

  /// The plane is m . p = 1, because 1 / z = m . (p / z) is linear in the pixel.
  void setPlane(float du, float dv, float inverse_depth, const Slope& slope, float edge,
                SurfacePixel& pixel) const {
    const float mx = slope.du * fx_, my = slope.dv * fy_, mz = inverse_depth - slope.du * du - slope.dv * dv;
    const float length = std::sqrt(mx * mx + my * my + mz * mz);
    const float rx = du / fx_, ry = dv / fy_, ray = std::sqrt(rx * rx + ry * ry + 1.0F);
    const float cosine = inverse_depth / (length * ray);
    if (!(inverse_depth > 0.0F && cosine > 0.0F)) return;
    const float depth = 1.0F / inverse_depth;
    pixel.free_depth = std::min(depth - truncation_ / (ray * std::max(cosine, kFreeMinCosine)), max_depth_);
    if (cosine < least_cosine_) return;
    pixel.nx = mx / length, pixel.ny = my / length, pixel.nz = mz / length;
    pixel.offset = 1.0F / length;
    pixel.weight = edge * cosine * static_cast<float>(sensor_.weight(static_cast<double>(depth), floor_));
    pixel.band_end = depth + truncation_ / ray * std::min(1.0F / cosine, kMaxBehind);
  }

  int reach_, width_, height_;
  float fx_, fy_, cx_, cy_, truncation_, max_depth_;
  SensorModel sensor_;
  float least_cosine_;
  double floor_;
};

/// Replaces each known free depth by the least of the window.
void erodeFreeDepth(SurfacePixels& image, int reach) {
  const int width = image.width;
  const auto index = [width](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  std::vector<float> along_row(image.pixels.size());
  const tbb::blocked_range<int> all(0, image.height);
  tbb::parallel_for(all, [&](const tbb::blocked_range<int>& rows) {
    for (int v = rows.begin(); v != rows.end(); ++v) {
      for (int u = 0; u < width; ++u) {
        float least = kInfinity;
        for (int x = std::max(u - reach, 0); x <= std::min(u + reach, width - 1); ++x) {
          const float depth = image.pixels[index(x, v)].free_depth;
          if (depth != 0.0F) least = std::min(least, depth);
        }
        along_row[index(u, v)] = least;
      }
    }
  });
  tbb::parallel_for(all, [&](const tbb::blocked_range<int>& rows) {
    for (int v = rows.begin(); v != rows.end(); ++v) {
      for (int u = 0; u < width; ++u) {
        float& depth = image.pixels[index(u, v)].free_depth;
        if (depth == 0.0F) continue;
        float least = kInfinity;
        for (int y = std::max(v - reach, 0); y <= std::min(v + reach, image.height - 1); ++y) {
          least = std::min(least, along_row[index(u, y)]);
        }
        depth = std::max(least, 0.0F);
      }
    }
  });
}

}  // namespace

SurfacePixels surfacePixels(const DepthImage& image, const CameraIntrinsics& intrinsics,
                            const FusionOptions& options) {
  SurfacePixels result;
  result.width = image.width, result.height = image.height;
  result.pixels.resize(image.depth.size());
  const InverseDepth inverse(image, options.min_depth);
  const double focal = std::min(std::abs(intrinsics.fx), std::abs(intrinsics.fy));
  const double window = std::min(0.5 * options.voxel_size * focal / kWindowDepth, 1.0 * kMaxReach);
  const int reach = std::max(static_cast<int>(window), 1);
  const PixelMaker maker(intrinsics, options, reach);
  const auto slope = static_cast<float>(kMaxSlope / focal);
  const InverseNoise noise(sensorModel(options.sensor));
  tbb::parallel_for(tbb::blocked_range<int>(0, image.height, 8), [&](const tbb::blocked_range<int>& rows) {
    for (int v = rows.begin(); v != rows.end(); ++v) {
      SurfacePixel* out =
          result.pixels.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width);
      for (int first = 0; first < image.width; first += kRun) {
        const float* around[2 * kMaxReach + 1];
        for (int dy = -kMaxReach; dy <= kMaxReach; ++dy) around[kMaxReach + dy] = inverse.row(v + dy) + first;
        const float* centre = around[kMaxReach];
        RunSums sums;
        sumWindow(around, reach, RunLimits(centre, slope, noise), sums);
        for (int n = 0; n < std::min(kRun, image.width - first); ++n)
          out[first + n] = maker.make(first + n, v, centre[n], sums, n);
      }
    }
  });
  if (options.carve) erodeFreeDepth(result, reach);
  return result;
}

}  // namespace ttsdf
