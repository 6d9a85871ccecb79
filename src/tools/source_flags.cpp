#include "source_flags.h"

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace ttsdf {

namespace {

void requireOneOf(const char* flag, const std::string& got, std::initializer_list<const char*> choices) {
  std::string wanted;
  for (const char* const* choice = choices.begin(); choice != choices.end(); ++choice) {
    if (got == *choice) return;
    wanted += (choice == choices.begin()     ? ""
               : choice + 1 == choices.end() ? " or "
                                             : ", ") +
              std::string(*choice);
  }
  throw UsageError(std::string("--") + flag + ": got '" + got + "', wanted " + wanted);
}

}  // namespace

void declareFrames(CommandLine& line, BuildArguments& a) {
  line.value("frames", "DIR", a.frames,
             "Folder of depth frames with poses, its layout is found out: 7-Scenes / 3DMatch "
             "(frame-NNNNNN.depth.png, "
             "frame-NNNNNN.pose.txt, camera-intrinsics.txt), BundleFusion, ScanNet, TUM RGB-D, Redwood / "
             "Open3D, ICL-NUIM, "
             "Replica.")
      .value("every", "N", a.every, "Takes the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("depth-scale", "N", a.depth_scale,
             "Units of the depth images per metre; 0: as the layout has it (1000; TUM and ICL-NUIM 5000).")
      .value("poses", "DIRECTION", a.poses, "What the poses map: camera-to-world or world-to-camera.")
      .value("camera-axes", "AXES", a.camera_axes,
             "opencv (x right, y down, z forward) or opengl (x right, y up, z backward).")
      .value(
          "mirror-poses", "AXIS", a.mirror_poses,
          "Poses of a left-handed system: x, y (Unity) or z is turned round; positions-x, -y or -z: of the "
          "positions alone; rotations-AB: of the rotations alone, A of the world's axes and B of the "
          "camera's; none.")
      .value("quaternions", "ORDER", a.quaternions, "xyzw or wxyz, where the poses are quaternions.")
      .value("pose-scale", "S", a.pose_scale, "Metres per unit of the poses.")
      .value("stamp-shift", "SECONDS", a.stamp_shift,
             "Added to the stamps of images before their poses are looked up.")
      .value("intrinsics", "FX,FY,CX,CY", a.intrinsics, "Instead of those of the folder.")
      .flag("trust-frames", a.trust_frames, "Goes on even if the frames contradict one another.");
}

void declareSources(CommandLine& line, BuildArguments& a) {
  declareFrames(line, a);
  line.value("mesh", "FILE", a.mesh, "Mesh: .ply, .obj, .off, .stl, .gltf or .glb.")
      .value("vdb", "FILE", a.vdb, "Level set or truncated signed distance grid (OpenVDB).")
      .value("grid", "NAME", a.grid, "Grid of the .vdb file, where it holds several.")
      .value("cloud", "FILE", a.cloud,
             "Points of surfaces: .pcd, .ply, .xyz, .csv or .bin; normals are used or estimated.")
      .value("cloud-from", "SIDE", a.cloud_from,
             "Where free space is for a cloud without normals and viewpoint: inside (rooms) or outside "
             "(objects).")
      .value("octomap", "FILE", a.octomap, "Octree of octomap: .bt or .ot.")
      .value("scale", "S", a.scale, "Metres per unit of the mesh, cloud, .vdb file or octree.");
}

void checkFrameFlags(const BuildArguments& a) {
  if (a.every < 1 || a.offset < 0 || a.offset >= a.every) {
    throw UsageError("got --every " + std::to_string(a.every) + " --offset " + std::to_string(a.offset) +
                     ", wanted 0 <= offset < every");
  }
  if (!(a.depth_scale >= 0.0)) throw UsageError("--depth-scale: wanted a number above 0");
  if (!(a.pose_scale > 0.0)) throw UsageError("--pose-scale: wanted a number above 0");
  requireOneOf("poses", a.poses, {"camera-to-world", "world-to-camera"});
  requireOneOf("camera-axes", a.camera_axes, {"opencv", "opengl"});
  requireOneOf("mirror-poses", a.mirror_poses,
               {"none", "x", "y", "z", "positions-x", "positions-y", "positions-z", "rotations-xx",
                "rotations-xy", "rotations-xz", "rotations-yx", "rotations-yy", "rotations-yz",
                "rotations-zx", "rotations-zy", "rotations-zz"});
  requireOneOf("quaternions", a.quaternions, {"xyzw", "wxyz"});
}

void checkSources(const BuildArguments& a) {
  const int sources =
      !a.frames.empty() + !a.mesh.empty() + !a.vdb.empty() + !a.cloud.empty() + !a.octomap.empty();
  if (sources != 1) {
    throw UsageError("got " + std::to_string(sources) +
                     " sources, wanted one of --frames, --mesh, --cloud, --vdb, --octomap");
  }
  checkFrameFlags(a);
  if (a.vdb.empty() && !a.grid.empty()) throw UsageError("got --grid without --vdb");
  if (!a.frames.empty() && a.scale != 1.0) {
    throw UsageError("got --scale with --frames, wanted --depth-scale (units of the depth images per metre)");
  }
  requireOneOf("cloud-from", a.cloud_from, {"inside", "outside"});
  if (!(a.scale > 0.0)) throw UsageError("--scale: wanted a number above 0");
  try {
    validate(a.build);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

FrameFolderOptions frameFolderOptions(const BuildArguments& a) {
  FrameFolderOptions options;
  options.units_per_metre = a.depth_scale;
  options.poses_world_to_camera = a.poses == "world-to-camera";
  options.opengl_axes = a.camera_axes == "opengl";
  if (a.mirror_poses.rfind("positions-", 0) == 0) {
    options.mirrored_positions = a.mirror_poses.back();
  } else if (a.mirror_poses.rfind("rotations-", 0) == 0) {
    options.mirrored_rotations = a.mirror_poses.substr(a.mirror_poses.size() - 2);
  } else if (a.mirror_poses != "none") {
    options.mirrored_axis = a.mirror_poses[0];
  }
  options.quaternions_w_first = a.quaternions == "wxyz";
  options.pose_scale = a.pose_scale;
  options.stamp_shift = a.stamp_shift;
  if (!a.intrinsics.empty()) {
    const auto k = parseNumbers("intrinsics", a.intrinsics, 4);
    options.intrinsics = Eigen::Vector4d(k[0], k[1], k[2], k[3]);
  }
  return options;
}

}  // namespace ttsdf
