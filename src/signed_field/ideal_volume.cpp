#include "ttsdf_localization/signed_field/ideal_volume.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "../build_steps/parallel.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {
namespace {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using MaskLeaf = openvdb::MaskTree::LeafNodeType;
constexpr int kLeafSide = FloatLeaf::DIM;
constexpr int kPortion = 8 * kLeafSide;  // samples asked for at a time, per axis

class Filler {
 public:
  Filler(TsdfVolume& volume, const DistanceSampler& distances, const Eigen::Array3i& begin, const Dims& size)
      : grids_(volume.grids()),
        distances_(distances),
        begin_(begin),
        end_(begin + size),
        truncation_(static_cast<float>(volume.options().truncation)) {}

  /// The blocks of [corner, corner + kPortion).
  void fillPortion(const Eigen::Array3i& corner) {
    const Eigen::Array3i low = corner.max(begin_), high = (corner + kPortion).min(end_);
    if ((low >= high).any()) return;
    const Dims size = high - low;
    std::vector<float> values(static_cast<std::size_t>(size.prod()));
    distances_(low, size, values.data());
    for (int x = corner[0]; x < high[0]; x += kLeafSide) {
      for (int y = corner[1]; y < high[1]; y += kLeafSide) {
        for (int z = corner[2]; z < high[2]; z += kLeafSide) fillBlock({x, y, z}, low, size, values);
      }
    }
  }

 private:
  void fillBlock(const Eigen::Array3i& block, const Eigen::Array3i& low, const Dims& size,
                 const std::vector<float>& values) {
    const openvdb::Coord origin(block[0], block[1], block[2]);
    auto tsdf = std::make_unique<FloatLeaf>(origin, truncation_, false);
    auto weight = std::make_unique<FloatLeaf>(origin, 0.0F, false);
    auto free = std::make_unique<MaskLeaf>(origin, false);
    const Eigen::Array3i from = block.max(low), to = (block + kLeafSide).min(low + size);
    for (int z = from[2]; z < to[2]; ++z) {
      for (int y = from[1]; y < to[1]; ++y) {
        const Eigen::Array3i local = Eigen::Array3i(from[0], y, z) - low;
        std::size_t n = static_cast<std::size_t>(local[0] + size[0] * (local[1] + size[1] * local[2]));
        for (int x = from[0]; x < to[0]; ++x, ++n) {
          const auto place =
              static_cast<openvdb::Index>(((x - block[0]) << 6) | ((y - block[1]) << 3) | (z - block[2]));
          if (values[n] > truncation_) {
            free->setValueOn(place);
          } else if (values[n] >= -truncation_) {
            tsdf->setValueOn(place, values[n]);
            weight->setValueOn(place, 1.0F);
          }
        }
      }
    }
    const std::lock_guard<std::mutex> lock(guard_);
    if (!tsdf->isEmpty()) {
      grids_.tsdf->tree().addLeaf(tsdf.release());
      grids_.weight->tree().addLeaf(weight.release());
    }
    if (free->isDense()) {
      grids_.free->tree().addTile(1, origin, true, true);
    } else if (!free->isEmpty()) {
      grids_.free->tree().addLeaf(free.release());
    }
  }

  TsdfVolume::Grids& grids_;
  const DistanceSampler& distances_;
  Eigen::Array3i begin_, end_;
  float truncation_;
  std::mutex guard_;
};

}  // namespace

TsdfVolume idealVolume(const DistanceSampler& distances, const Eigen::Array3i& begin, const Dims& size,
                       const FusionOptions& options) {
  if (!(size >= 1).all()) {
    std::ostringstream text;
    text << "ideal volume: got extents " << size.transpose() << ", wanted at least 1";
    throw std::invalid_argument(text.str());
  }
  TsdfVolume volume(options);
  Filler filler(volume, distances, begin, size);
  const Eigen::Array3i first = begin.unaryExpr([](int index) { return index & ~(kLeafSide - 1); });
  const Dims portions = (begin + size - first + kPortion - 1) / kPortion;
  parallelFor(portions.prod(), options.threads, [&](int n) {
    const Eigen::Array3i at(n % portions[0], n / portions[0] % portions[1], n / portions[0] / portions[1]);
    filler.fillPortion(first + kPortion * at);
  });
  return volume;
}

}  // namespace ttsdf
