#include "block_update.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "surface_guard.h"

namespace ttsdf {

namespace {

constexpr float kFarWeight = 0.05F;    // of bandWeight at the ends of the band
constexpr float kReleaseShare = 0.5F;  // of the truncation, above which carved band is given up

/// A visited block's leaves. Leaves that do not exist yet are made by the worker and enter the trees
/// afterwards, one by one: growing an OpenVDB tree is not thread-safe, writing to its leaves is.
struct Target {
  FloatLeaf* tsdf = nullptr;
  FloatLeaf* weight = nullptr;
  MaskLeaf* free = nullptr;
  std::unique_ptr<FloatLeaf> new_tsdf, new_weight;
  std::unique_ptr<MaskLeaf> new_free;
  bool free_tile = false;  ///< wholly free already
  float fill = 0.0F;       ///< value of tsdf's tile here
  BlockMask near_surface;  ///< before this scan: band here is not carved unless negative
};

class BlockUpdater {
 public:
  BlockUpdater(TsdfVolume::Grids& grids, const FusionOptions& options)
      : grids_(grids),
        background_(grids.tsdf->background()),
        truncation_(static_cast<float>(options.truncation)),
        max_weight_(static_cast<float>(options.max_weight)),
        guard_radius_(static_cast<int>(std::ceil(options.truncation / options.voxel_size - 1e-6))),
        carve_(options.carve) {}

  void run(const std::vector<BlockVisit>& visits, const ObserveBlock& observe) {
    findLeaves(visits);
    // Guards first and for all blocks: they read neighbours, which the update writes.
    if (carve_) {
      forEach([&](std::size_t i) {
        if (targets_[i].tsdf) {
          targets_[i].near_surface = nearNegative(grids_.tsdf->tree(), visits[i].origin, guard_radius_);
        }
      });
    }
    forEach([&](std::size_t i) { update(i, visits[i], observe); });
    for (std::size_t i = 0; i < visits.size(); ++i) store(visits[i], targets_[i]);
  }

 private:
  template <class Work>
  void forEach(const Work& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, targets_.size(), 16),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                      });
  }

  void findLeaves(const std::vector<BlockVisit>& visits) {
    auto tsdf = grids_.tsdf->getAccessor();
    auto weight = grids_.weight->getAccessor();
    auto free = grids_.free->getAccessor();
    targets_.resize(visits.size());
    for (std::size_t i = 0; i < visits.size(); ++i) {
      const openvdb::Coord& origin = visits[i].origin;
      Target& target = targets_[i];
      target.tsdf = tsdf.probeLeaf(origin);
      target.weight = weight.probeLeaf(origin);
      target.free = free.probeLeaf(origin);
      target.free_tile = !target.free && free.isValueOn(origin);
      target.fill = target.tsdf ? 0.0F : tsdf.getValue(origin);
    }
  }

  void update(std::size_t index, const BlockVisit& visit, const ObserveBlock& observe) {
    Target& target = targets_[index];
    if (visit.all_free) {
      if (target.tsdf) carve(BlockMask(true), visit.free_weight, target);
      return;
    }
    BlockObservation observation;
    observe(index, observation);
    if (carve_ && !observation.free.isOff()) {
      if (target.tsdf) carve(observation.free, observation.free_weight, target);
      markFree(observation.free, visit.origin, target);
    }
    if (observation.has_band) average(observation, visit.origin, target);
  }

  void carve(const BlockMask& free, float free_weight, Target& target) const {
    BlockMask carved = free;
    carved &= target.tsdf->getValueMask();
    float* values = target.tsdf->buffer().data();
    float* weights = target.weight->buffer().data();
    for (auto it = carved.beginOn(); it; ++it) {
      const openvdb::Index n = it.pos();
      const bool guarded = target.near_surface.isOn(n);
      if (values[n] >= 0.0F && guarded) continue;
      addSample(truncation_, free_weight, values[n], weights[n]);
      if (guarded || values[n] < kReleaseShare * truncation_) continue;
      values[n] = background_, weights[n] = 0.0F;
      target.tsdf->getValueMask().setOff(n);
      target.weight->getValueMask().setOff(n);
    }
  }

  static void markFree(const BlockMask& free, const openvdb::Coord& origin, Target& target) {
    if (target.free_tile) return;
    MaskLeaf* leaf = target.free;
    if (!leaf) {
      target.new_free = std::make_unique<MaskLeaf>(origin, false);
      leaf = target.new_free.get();
    }
    BlockMask all = leaf->getValueMask();
    all |= free;
    leaf->setValueMask(all);
  }

  void average(const BlockObservation& observation, const openvdb::Coord& origin, Target& target) const {
    if (!target.tsdf) {
      target.new_tsdf = std::make_unique<FloatLeaf>(origin, target.fill, false);
      target.new_weight = std::make_unique<FloatLeaf>(origin, 0.0F, false);
    }
    FloatLeaf& tsdf = target.tsdf ? *target.tsdf : *target.new_tsdf;
    FloatLeaf& weight = target.weight ? *target.weight : *target.new_weight;
    float* values = tsdf.buffer().data();
    float* weights = weight.buffer().data();
    for (openvdb::Index n = 0; n < kBlockVoxels; ++n) {
      if (!(observation.weight[n] > 0.0F)) continue;
      addSample(observation.distance[n], observation.weight[n], values[n], weights[n]);
      tsdf.getValueMask().setOn(n);
      weight.getValueMask().setOn(n);
    }
  }

  void addSample(float distance, float sample_weight, float& value, float& weight) const {
    const float sum = weight + sample_weight;
    value = (weight * value + sample_weight * distance) / sum;
    weight = std::min(sum, max_weight_);
  }

  void store(const BlockVisit& visit, Target& target) {
    if (target.new_tsdf) {
      grids_.tsdf->tree().addLeaf(target.new_tsdf.release());
      grids_.weight->tree().addLeaf(target.new_weight.release());
    } else if (target.tsdf && target.tsdf->isEmpty()) {
      grids_.tsdf->tree().addTile(1, visit.origin, background_, false);
      grids_.weight->tree().addTile(1, visit.origin, 0.0F, false);
    }
    if (!carve_ || target.free_tile) return;
    const MaskLeaf* leaf = target.free ? target.free : target.new_free.get();
    if (visit.all_free || (leaf && leaf->isDense())) {
      grids_.free->tree().addTile(1, visit.origin, true, true);
    } else if (target.new_free) {
      grids_.free->tree().addLeaf(target.new_free.release());
    }
  }

  TsdfVolume::Grids& grids_;
  float background_, truncation_, max_weight_;
  int guard_radius_;
  bool carve_;
  std::vector<Target> targets_;
};

}  // namespace

float bandWeight(float distance, float voxel_size, float truncation) {
  const float beyond = std::abs(distance) - voxel_size;
  if (beyond <= 0.0F || truncation <= voxel_size) return 1.0F;
  return std::max(kFarWeight, 1.0F - beyond / (truncation - voxel_size));
}

void updateBlocks(TsdfVolume::Grids& grids, const FusionOptions& options,
                  const std::vector<BlockVisit>& visits, const ObserveBlock& observe) {
  BlockUpdater(grids, options).run(visits, observe);
}

}  // namespace ttsdf
