#pragma once
// Files from the bytes of a fuzzer, for readers that take a path.

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "input.h"

namespace ttsdf::fuzz {

/// A folder of this process, in memory where there is such a place; removed when the program ends.
class Folder {
 public:
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    path_ = (std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path()) /
            ("ttsdf_fuzz_" + std::to_string(getpid()));
    clear();
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string write(const std::string& name, const std::uint8_t* data, std::size_t size) const {
    const std::filesystem::path path = path_ / name;
    std::ofstream(path, std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    return path.string();
  }
  void clear() const {
    std::filesystem::remove_all(path_);
    for (const char* name : {"depth", "pose", "intrinsic", "results"})
      std::filesystem::create_directories(path_ / name);
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// The first byte chooses the file's ending, the rest is its content; `read` may throw what readers throw.
template <class Read>
void readAsFile(const std::uint8_t* data, std::size_t size, const std::vector<std::string>& endings,
                const Read& read) {
  static const Folder folder;
  if (size == 0) return;
  const std::string path = folder.write("file" + chosen(endings, *data), data + 1, size - 1);
  try {
    read(path);
  } catch (const std::runtime_error&) {
  }
}

inline const std::vector<std::string> kCloudEndings{".pcd", ".ply", ".xyz", ".csv", ".bin"};
inline const std::vector<std::string> kMeshEndings{".ply", ".obj", ".off", ".stl"};
/// What the layouts of frame folders consist of.
inline const std::vector<std::string> kFrameFiles{"camera-intrinsics.txt",
                                                  "frame-000000.depth.png",
                                                  "frame-000000.pose.txt",
                                                  "info.txt",
                                                  "depth.txt",
                                                  "groundtruth.txt",
                                                  "depth/1.png",
                                                  "depth/0.png",
                                                  "pose/0.txt",
                                                  "intrinsic/intrinsic_depth.txt",
                                                  "trajectory.log",
                                                  "livingRoom2.gt.freiburg",
                                                  "traj.txt",
                                                  "results/depth000000.png",
                                                  "cam_params.json",
                                                  "associations.txt"};

}  // namespace ttsdf::fuzz
