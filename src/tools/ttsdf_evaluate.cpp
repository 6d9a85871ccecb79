// The paper's perturbation sweep over one data set and any number of methods.

#include <algorithm>
#include <iostream>

#include "ttsdf_localization/evaluation/method_factory.h"
#include "ttsdf_localization/evaluation/method_memory.h"
#include "ttsdf_localization/evaluation/sweep.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/progress.h"
#include "ttsdf_localization/tools/scan_io.h"

namespace {

struct Arguments {
  std::string map, frames, dataset, output, translations = "0.05,0.1,0.2,0.5,1.0",
                                            rotations = "0.01,0.02,0.05,0.1,0.25", map_down, map_mesh,
                                            map_cloud, memory;
  std::vector<std::string> methods;
  double depth_scale = 1000.0, cell = 0.05, gravity_sigma = 0.1;
  int every = 10, offset = 5, stride = 8, map_every = 10, map_offset = 0, map_stride = 2, directions = 5,
      repeat = 1;
  int sweep_seed = 1;
  bool quiet = false;
  ttsdf::FrameSelection selection;
  ttsdf::MethodDefaults defaults;
};

void declare(ttsdf::CommandLine& line, Arguments& a) {
  line.value("map", "MAP.ttsdf", a.map, "The map of the methods that name none.")
      .value("frames", "DIR", a.frames, "Frames folder with the scans and their true poses.")
      .value("output", "LOG.csv", a.output, "One row per estimate. What it already holds is not run again.")
      .value("methods", "SPEC", a.methods,
             "[label=]kind[:key=value,...], any number. Kinds: prior, track, search, global, paper (its own "
             "Gauss-Newton), icp, icp_plane, gicp, ndt (PCL), open3d_icp, open3d_icp_plane, fgr, ransac "
             "(Open3D, where "
             "installed). Keys: map, interpolation, dense, and every option below. (default track)")
      .value("dataset", "NAME", a.dataset,
             "Label of the data set in the log (default: name of the frames folder).")
      .value("every", "N", a.every, "Scans are the frames whose index % N is the offset.")
      .value("offset", "M", a.offset, "See --every.")
      .value("stride", "N", a.stride, "Scan points are every N-th pixel in both directions.")
      .value("min-depth", "METRES", a.selection.min_depth, "Nearest scan point.")
      .value("max-depth", "METRES", a.selection.max_depth, "Farthest scan point.")
      .value("depth-scale", "N", a.depth_scale, "Units of the depth images per metre.")
      .value("translations", "LIST", a.translations, "Perturbations [m]; 'none' for none.")
      .value("rotations", "LIST", a.rotations, "Perturbations [rad]; 'none' for none.")
      .value("directions", "N", a.directions, "Directions per magnitude and scan.")
      .value("sweep-seed", "N", a.sweep_seed, "Seed of the directions.")
      .value("repeat", "N", a.repeat, "Times are the median of as many calls.")
      .value("memory", "MEMORY.csv", a.memory, "Where to note the map memory of every method.")
      .value("map-mesh", "FILE", a.map_mesh, "Point cloud map from a mesh instead of frames.")
      .value("map-cloud", "FILE", a.map_cloud, "Point cloud map from a file (.ply, .pcd), as it is.")
      .value("map-every", "N", a.map_every, "Point cloud map: the frames whose index % N is --map-offset.")
      .value("map-offset", "M", a.map_offset, "See --map-every.")
      .value("map-stride", "N", a.map_stride, "Point cloud map: every N-th pixel in both directions.")
      .value("cell", "METRES", a.cell, "Point cloud map: one point per cell of this size.")
      .value("map-down", "X,Y,Z", a.map_down,
             "Down direction in the map frame: gives kind global a gravity hint.")
      .value("gravity-sigma", "RAD", a.gravity_sigma, "Error of that hint per axis.")
      .flag("quiet", a.quiet, "Prints no table.")
      .options("registration", ttsdf::registrationOptionTable(), a.defaults.registration)
      .options("search", ttsdf::searchOptionTable(), a.defaults.search)
      .options("global", ttsdf::globalOptionTable(), a.defaults.global)
      .options("cloud", ttsdf::cloudMethodOptionTable(), a.defaults.cloud);
}

std::vector<double> magnitudes(const std::string& flag, const std::string& text) {
  return text == "none" ? std::vector<double>{} : ttsdf::parseNumberList(flag, text);
}

ttsdf::FrameSelection selection(const Arguments& a, int every, int offset, int stride) {
  if (every < 1 || offset < 0 || offset >= every || stride < 1) {
    throw ttsdf::UsageError("got every " + std::to_string(every) + ", offset " + std::to_string(offset) +
                            ", stride " + std::to_string(stride) +
                            "; wanted 0 <= offset < every and stride >= 1");
  }
  ttsdf::FrameSelection result = a.selection;
  result.every = every;
  result.offset = offset;
  result.stride = stride;
  return result;
}

std::vector<ttsdf::MethodSpec> methods(const Arguments& a) {
  std::vector<ttsdf::MethodSpec> specs;
  for (const auto& text : a.methods.empty() ? std::vector<std::string>{"track"} : a.methods) {
    try {
      specs.push_back(ttsdf::parseMethodSpec(text));
    } catch (const std::invalid_argument& error) {
      throw ttsdf::UsageError(error.what());
    }
  }
  return specs;
}

// Points without a direction to the sensor: for methods without descriptors.
ttsdf::MapCloud cloudFromFile(const std::string& path) {
  ttsdf::MapCloud cloud;
  cloud.points = ttsdf::readScan(path);
  cloud.towards_sensor = Eigen::Matrix3Xf::Zero(3, cloud.points.cols());
  return cloud;
}

std::string datasetName(const Arguments& a) {
  if (!a.dataset.empty()) return a.dataset;
  const auto last = a.frames.find_last_not_of('/');
  const std::string path = a.frames.substr(0, last + 1);
  return path.substr(path.rfind('/') + 1);
}

// What the method gives back when it goes is what its map took: the map as loaded and all that the scans left
// behind. A run that found everything in the log has filled no cache: what it would note is smaller than
// before.
void noteMemory(const std::string& path, const ttsdf::SweepRun& sweep,
                std::unique_ptr<ttsdf::Method> method) {
  ttsdf::MethodMemory row{sweep.dataset, sweep.method, method->paperBytes(), ttsdf::heapBytes()};
  method.reset();
  row.memory_bytes -= std::min(row.memory_bytes, ttsdf::heapBytes());
  for (const auto& before : ttsdf::readMethodMemory(path)) {
    const bool same = before.dataset == row.dataset && before.method == row.method;
    if (same) row.memory_bytes = std::max(row.memory_bytes, before.memory_bytes);
  }
  ttsdf::recordMethodMemory(path, row);
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line(
      "ttsdf_evaluate", "--map MAP.ttsdf --frames DIR --output LOG.csv [--methods SPEC...] [options]",
      "Runs the perturbation sweep: every scan from its true pose, moved or turned by known amounts.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (a.frames.empty()) throw ttsdf::UsageError("--frames is missing");
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  const auto specs = methods(a);
  const auto scan_selection = selection(a, a.every, a.offset, a.stride);
  const auto map_selection = selection(a, a.map_every, a.map_offset, a.map_stride);
  const ttsdf::SweepPlan plan{magnitudes("translations", a.translations),
                              magnitudes("rotations", a.rotations), a.directions, a.sweep_seed};
  ttsdf::SweepRun sweep{datasetName(a), "", std::nullopt, a.gravity_sigma, a.repeat};
  if (!a.map_down.empty()) {
    const auto down = ttsdf::parseNumbers("map-down", a.map_down, 3);
    sweep.map_down = Eigen::Vector3d(down[0], down[1], down[2]).normalized();
    a.defaults.map_down = *sweep.map_down;
  }

  ttsdf::Progress progress("ttsdf_evaluate");
  const ttsdf::FrameFolder folder(a.frames, a.depth_scale);
  progress.update("reading scans", 0.0);
  const auto scans = ttsdf::scansFromFrames(folder, scan_selection);
  for (const auto& reason : scans.skipped) progress.warn("frame skipped: " + reason);
  a.defaults.map = a.map;
  a.defaults.map_cloud = [&] {
    progress.update("point cloud map", 0.0);
    if (!a.map_cloud.empty()) return cloudFromFile(a.map_cloud);
    if (!a.map_mesh.empty()) return ttsdf::mapCloudFromMesh(ttsdf::readMesh(a.map_mesh), a.cell);
    return ttsdf::mapCloudFromFrames(folder, map_selection, a.cell);
  };
  ttsdf::MethodFactory factory(a.defaults);
  ttsdf::SweepLog log(a.output);
  for (const auto& spec : specs) {
    sweep.method = spec.label;
    auto method = factory.make(spec);
    ttsdf::runSweep(sweep, *method, scans.scans, plan, log, [&](double share) {
      progress.update(spec.label, share);
      return true;
    });
    if (!a.memory.empty()) noteMemory(a.memory, sweep, std::move(method));
  }
  if (!a.quiet) std::cout << ttsdf::toTable(ttsdf::summarize(log.records()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_evaluate", [&] { return run(argc, argv); });
}
