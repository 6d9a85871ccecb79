#include "ros/builder/fusion_checkpoint.h"

#include <ros/console.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

FusionCheckpoint::FusionCheckpoint(std::string file, const FusionOptions& fusion)
    : file_(std::move(file)), fusion_(fusion) {}

std::optional<TsdfVolume> FusionCheckpoint::read() const {
  if (!kept()) return std::nullopt;
  requireWritable(pathInFolder("checkpoint_file", file_, ""), kVdbFile);
  if (!std::filesystem::exists(file_)) return std::nullopt;
  TsdfVolume volume = TsdfVolume::fromVdbFile(file_, fusion_);
  if (volume.options().voxel_size != fusion_.voxel_size) {
    throw std::runtime_error("checkpoint_file '" + file_ + "': got voxels of " +
                             std::to_string(volume.options().voxel_size) + " m, wanted fusion/voxel_size " +
                             std::to_string(fusion_.voxel_size) + "; remove the file, or set that size");
  }
  ROS_INFO_STREAM("Going on with " << volume.frameCount() << " scans fused before, of " << file_);
  return volume;
}

void FusionCheckpoint::write(ScanFuser& fuser) {
  if (!kept()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::uint32_t fused = fuser.counts().fused;
  if (fused == kept_scans_) return;
  try {
    fuser.withVolume([&](const TsdfVolume& volume) { volume.saveVdb(file_); });
    kept_scans_ = fused;
    problem_.clear();
  } catch (const std::exception& error) {
    problem_ = error.what();
    ROS_ERROR_STREAM_THROTTLE(60.0, "No checkpoint: " << error.what());
  }
}

void FusionCheckpoint::forget() {
  if (!kept()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  std::remove(file_.c_str());
  kept_scans_ = 0;
}

std::string FusionCheckpoint::problem() const {
  const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
  return lock ? problem_ : std::string();
}

}  // namespace ttsdf
