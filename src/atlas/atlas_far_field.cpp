#include "atlas_far_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace ttsdf {

AtlasField::Far::Far(std::shared_ptr<const Members> members)
    : members_(std::move(members)), geometry_(members_->geometry) {
  for (const PlacedField& map : members_->maps) {
    if (map.far) geometry_.voxel_size = std::max(geometry_.voxel_size, map.far->geometry().voxel_size);
  }
  const double ratio = geometry_.voxel_size / members_->geometry.voxel_size;
  geometry_.dims = ((geometry_.dims - 1).cast<double>() / ratio).ceil().cast<int>() + 1;
}

void AtlasField::Far::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  for (int begin = 0; begin < points.size; begin += kAtlasPiece) {
    evaluatePiece(points, samples, begin, std::min(kAtlasPiece, points.size - begin));
  }
}

void AtlasField::Far::evaluatePiece(const PointSpan& points, const SampleSpan& samples, int begin,
                                    int size) const {
  Eigen::Vector3f p[kAtlasPiece];
  bool held[kAtlasPiece];
  Eigen::AlignedBox3f bounds;
  for (int n = 0; n < size; ++n) {
    p[n] = {points.x[begin + n], points.y[begin + n], points.z[begin + n]};
    held[n] = false;
    if (p[n].allFinite()) bounds.extend(p[n]);
    setOutside(samples, begin + n);
  }
  AtlasBatch batch;
  const auto answer = [&](const AtlasMember& member) {
    if (batch.size == 0) return;
    batch.evaluate(*member.far);
    for (int k = 0; k < batch.size; ++k) {
      const int n = begin + batch.point[k];
      if (batch.state[k] != PointState::kValid) continue;
      if (samples.state[n] == PointState::kValid && std::abs(samples.value[n]) <= std::abs(batch.value[k]))
        continue;
      batch.writeSample(member, k, samples, n);
    }
  };
  float depths[kAtlasPiece];
  for (const AtlasMember& member : members_->members) {
    if (!member.far || !member.bounds.intersects(bounds)) continue;  // most of many maps are elsewhere
    member.depthsInside(points, begin, size, depths);
    batch.size = 0;
    for (int n = 0; n < size; ++n) {
      if (!(depths[n] >= 0.0F)) continue;
      held[n] = true;
      batch.add(member, n, p[n]);
    }
    answer(member);
  }
  if (std::all_of(held, held + size, [](bool one) { return one; })) return;
  // The nearest map answers for a point that none holds.
  float deepest[kAtlasPiece];
  const AtlasMember* nearest[kAtlasPiece];
  std::fill(deepest, deepest + size, -std::numeric_limits<float>::infinity());
  std::fill(nearest, nearest + size, nullptr);
  for (const bool near : {true, false}) {
    for (const AtlasMember& member : members_->members) {
      if (!member.far || member.bounds.intersects(bounds) != near) continue;
      for (int n = 0; n < size; ++n) {
        if (held[n]) continue;
        const float depth = member.depth(p[n]);
        if (depth > deepest[n]) deepest[n] = depth, nearest[n] = &member;
      }
    }
  }
  for (const AtlasMember& member : members_->members) {
    batch.size = 0;
    for (int n = 0; n < size; ++n) {
      if (!held[n] && nearest[n] == &member) batch.add(member, n, p[n]);
    }
    answer(member);
  }
}

std::size_t AtlasField::Far::memoryBytes() const {
  std::set<const DistanceField*> counted;
  std::size_t bytes = 0;
  for (const PlacedField& map : members_->maps) {
    if (map.far && counted.insert(map.far.get()).second) bytes += map.far->memoryBytes();
  }
  return bytes;
}

}  // namespace ttsdf
