#include "export_file.h"

#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

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
