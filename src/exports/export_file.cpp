#include "export_file.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>

#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

std::string endingOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::string requireEnding(const char* what, const std::string& path,
                          std::initializer_list<const char*> wanted) {
  const std::string ending = endingOf(path);
  if (std::find(wanted.begin(), wanted.end(), ending) != wanted.end()) return ending;
  std::string list;
  std::size_t left = wanted.size();
  for (const char* const one : wanted)
    list += std::string(one) + (--left == 0 ? "" : left == 1 ? " or " : ", ");
  throw std::invalid_argument(std::string(what) + " '" + path + "': got ending '" + ending + "', wanted " +
                              list);
}

Eigen::AlignedBox3d boxOf(const GridGeometry& geometry) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    box.extend(geometry.samplePosition((bits * (geometry.dims - 1)).cast<double>().matrix()));
  }
  return box;
}

void writeExport(const std::string& path, const std::string& bytes) {
  writeFileAtomically(path, bytes.data(), bytes.size());
}

}  // namespace ttsdf
