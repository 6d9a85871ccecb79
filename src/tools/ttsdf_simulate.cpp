// Folders of simulated depth frames: a camera's way through an analytic world, or views of a mesh.

#include <cstdio>
#include <iostream>

#include "ttsdf_localization/evaluation/synthetic_frames.h"
#include "ttsdf_localization/simulation/mesh_renderer.h"
#include "ttsdf_localization/simulation/pose_noise.h"
#include "ttsdf_localization/simulation/simulated_rig.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

struct Arguments {
  std::string output, mesh, sensor = "none";
  double depth_scale = 1000.0, size = 1.0, laps = 1.0;
  int frames = 200, views = 5;
  ttsdf::SimulatedRigOptions rig;
  ttsdf::PoseNoiseOptions pose_noise;
};

void declare(ttsdf::CommandLine& line, Arguments& a) {
  line.value("output", "DIR", a.output,
             "Folder of the frames, in the layout that ttsdf_build --frames reads.")
      .value("frames", "N", a.frames, "Frames, spread evenly over the camera's way through the world.")
      .value("laps", "N", a.laps, "How many times round the camera goes.")
      .value(
          "mesh", "FILE", a.mesh,
          "Views of a model instead (.ply, .obj, .off). The model as it was rendered goes to DIR/mesh.ply.")
      .value("views", "N", a.views, "Views of the model, from all sides.")
      .value("size", "METRES", a.size, "Largest side that the model is scaled to.")
      .value("sensor", "NAME", a.sensor, "none | kinect | realsense: noise that replaces the options below.")
      .value("depth-scale", "N", a.depth_scale, "Units of the depth images per metre.")
      .options("world", ttsdf::simulatedRigOptionTable(), a.rig)
      .options("camera", ttsdf::depthCameraOptionTable(), a.rig.camera)
      .options("mount", ttsdf::cameraMountOptionTable(), a.rig.mount)
      .options("path", ttsdf::trajectoryOptionTable(), a.rig.path)
      .options("clutter", ttsdf::clutterOptionTable(), a.rig.clutter)
      .options("recorded poses", ttsdf::poseNoiseOptionTable(), a.pose_noise);
}

void check(const Arguments& a) {
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  if (a.frames < 1 || a.views < 1) throw ttsdf::UsageError("--frames, --views: wanted a number above 0");
  if (!(a.size > 0.0) || !(a.depth_scale > 0.0) || !(a.laps > 0.0)) {
    throw ttsdf::UsageError("--size, --depth-scale, --laps: wanted a number above 0");
  }
}

int simulateWorld(const Arguments& a, ttsdf::Progress& progress) {
  ttsdf::SimulatedRig rig(a.rig);
  const ttsdf::FrameWriter writer(a.output, rig.camera().intrinsics(), a.depth_scale);
  ttsdf::PoseNoise noise(a.pose_noise);
  for (int n = 0; n < a.frames; ++n) {
    progress.update("rendering", static_cast<double>(n) / a.frames);
    const auto state = rig.advance(a.laps * rig.trajectory().duration() * n / a.frames);
    const Eigen::Isometry3d T_map_camera = state.T_map_base * rig.cameraMount();
    writer.write(n, rig.image(state), noise.perturb(T_map_camera));
    if (!a.pose_noise.none()) writer.writeTruth(n, T_map_camera);
  }
  return a.frames;
}

int simulateMesh(const Arguments& a, ttsdf::Progress& progress) {
  const auto mesh = ttsdf::scaledTo(ttsdf::readMesh(a.mesh), a.size);
  const auto intrinsics = ttsdf::DepthCamera(a.rig.camera).intrinsics();
  const double radius = mesh.vertices.colwise().norm().maxCoeff();
  const ttsdf::FrameWriter writer(a.output, intrinsics, a.depth_scale);
  ttsdf::writePly(mesh, a.output + "/mesh.ply");
  int index = 0;
  ttsdf::PoseNoise noise(a.pose_noise);
  for (const auto& T_map_camera : ttsdf::viewsAround(radius, a.views, intrinsics)) {
    progress.update("rendering", static_cast<double>(index) / a.views);
    const auto image = ttsdf::renderMesh(mesh, a.rig.camera, T_map_camera, static_cast<std::uint64_t>(index));
    writer.write(index, image, noise.perturb(T_map_camera));
    if (!a.pose_noise.none()) writer.writeTruth(index, T_map_camera);
    ++index;
  }
  return index;
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line("ttsdf_simulate", "--output DIR [--scene NAME | --mesh FILE] [options]",
                          "Renders depth frames with exact poses.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  check(a);
  if (line.given("sensor")) a.rig.camera.noise = ttsdf::depthNoise(a.sensor);
  ttsdf::Progress progress("ttsdf_simulate");
  const int written = a.mesh.empty() ? simulateWorld(a, progress) : simulateMesh(a, progress);
  std::printf("%s: %d frames\n", a.output.c_str(), written);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_simulate", [&] { return run(argc, argv); });
}
