#pragma once
// How frames are to be read, for the commands of ttsdf_atlas that take some: flags as ttsdf_build has them.

#include <initializer_list>
#include <iostream>
#include <streambuf>
#include <string>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

inline void declareFrames(CommandLine& line, BuildArguments& a) {
  line.value("frames", "DIR", a.frames, "Folder of depth frames with poses, as ttsdf_build takes it.")
      .value("every", "N", a.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("depth-scale", "N", a.depth_scale,
             "Units of the depth images per metre; 0: as the layout has it (1000; TUM and ICL-NUIM 5000).")
      .value("poses", "DIRECTION", a.poses, "What the poses map: camera-to-world or world-to-camera.")
      .value("camera-axes", "AXES", a.camera_axes,
             "opencv (x right, y down, z forward) or opengl (x right, y up, z backward).")
      .value("mirror-poses", "AXIS", a.mirror_poses,
             "Poses of a left-handed system: x, y (Unity) or z is turned round; none.")
      .value("quaternions", "ORDER", a.quaternions, "xyzw or wxyz, where the poses are quaternions.")
      .value("pose-scale", "S", a.pose_scale, "Metres per unit of the poses.")
      .value("stamp-shift", "SECONDS", a.stamp_shift,
             "Added to the stamps of images before their poses are looked up.")
      .value("intrinsics", "FX,FY,CX,CY", a.intrinsics, "Instead of those of the folder.")
      .flag("trust-frames", a.trust_frames, "Goes on even if the frames contradict one another.");
}

/// Throws UsageError.
inline void checkFrameFlags(const BuildArguments& a) {
  const auto oneOf = [](const char* flag, const std::string& got,
                        std::initializer_list<const char*> choices) {
    std::string wanted;
    for (const char* choice : choices) {
      if (got == choice) return;
      wanted += (wanted.empty() ? "" : ", ") + std::string(choice);
    }
    throw UsageError(std::string("--") + flag + ": got '" + got + "', wanted one of " + wanted);
  };
  if (a.every < 1 || a.offset < 0 || a.offset >= a.every) {
    throw UsageError("got --every " + std::to_string(a.every) + " --offset " + std::to_string(a.offset) +
                     ", wanted 0 <= offset < every");
  }
  if (!(a.depth_scale >= 0.0)) throw UsageError("--depth-scale: wanted a number above 0");
  if (!(a.pose_scale > 0.0)) throw UsageError("--pose-scale: wanted a number above 0");
  oneOf("poses", a.poses, {"camera-to-world", "world-to-camera"});
  oneOf("camera-axes", a.camera_axes, {"opencv", "opengl"});
  oneOf("mirror-poses", a.mirror_poses, {"none", "x", "y", "z"});
  oneOf("quaternions", a.quaternions, {"xyzw", "wxyz"});
}

inline FrameFolderOptions frameFolderOptions(const BuildArguments& a) {
  FrameFolderOptions options;
  options.units_per_metre = a.depth_scale;
  options.poses_world_to_camera = a.poses == "world-to-camera";
  options.opengl_axes = a.camera_axes == "opengl";
  if (a.mirror_poses != "none") options.mirrored_axis = a.mirror_poses[0];
  options.quaternions_w_first = a.quaternions == "wxyz";
  options.pose_scale = a.pose_scale;
  options.stamp_shift = a.stamp_shift;
  if (!a.intrinsics.empty()) {
    const auto k = parseNumbers("intrinsics", a.intrinsics, 4);
    options.intrinsics = Eigen::Vector4d(k[0], k[1], k[2], k[3]);
  }
  return options;
}

/// As long as it lives, lines on std::cerr that begin with the name of ttsdf_build begin with this program's.
class OwnName : std::streambuf {
 public:
  OwnName() : out_(std::cerr.rdbuf(this)) {}
  ~OwnName() override {
    say();
    std::cerr.rdbuf(out_);
  }
  OwnName(const OwnName&) = delete;
  OwnName& operator=(const OwnName&) = delete;

 private:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    line_ += traits_type::to_char_type(c);
    if (line_.back() == '\n') say();
    return c;
  }
  void say() {
    static const std::string kOther = "ttsdf_build: ";
    if (line_.compare(0, kOther.size(), kOther) == 0) line_.replace(0, kOther.size(), "ttsdf_atlas: ");
    out_->sputn(line_.data(), static_cast<std::streamsize>(line_.size()));
    out_->pubsync();
    line_.clear();
  }

  std::string line_;
  std::streambuf* const out_;
};

}  // namespace ttsdf
