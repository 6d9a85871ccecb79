#include "atlas_mesh.h"

#include <limits>
#include <stdexcept>

#include "ttsdf_localization/mesh/mesh_sampling.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"

namespace ttsdf {

TsdfVolume volumeFromMesh(const BuildArguments& a, Progress& progress) {
  const BuildProgress show = [&progress](const std::string& step, double share) {
    progress.update(step, share);
    return true;
  };
  progress.update("reading the mesh", 0.0);
  const SurfaceMesh mesh = readMesh(a.mesh, a.scale);
  BuildOptions options = a.build;
  options.clamp_negative = options.clamp_positive = 0.0;  // what is deep in matter is no band
  options.align_axes = false;                             // cells lie along the axes of the map
  options.support_mask = false;
  MeshSides sides{};
  SampledField field;
  try {
    field = sampleMesh(mesh, a.fusion.voxel_size, options, show, &sides);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("'" + a.mesh + "': " + error.what());
  }
  if (sides == MeshSides::kUnsigned) {
    throw std::runtime_error(
        "'" + a.mesh +
        "': got an open mesh whose faces do not agree which side is out, wanted a closed "
        "one or one with faces turned alike (ttsdf_build makes one map of it)");
  }
  const DistanceSampler distances = [&field](const Eigen::Array3i& begin, const Dims& size, float* out) {
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i) {
          const std::size_t n = field.values.offset(begin[0] + i, begin[1] + j, begin[2] + k);
          *out++ = field.known[n] != 0 ? field.values.data()[n] : -std::numeric_limits<float>::infinity();
        }
      }
    }
  };
  TsdfVolume volume = idealVolume(distances, Eigen::Array3i::Zero(), field.geometry.dims, a.fusion);
  volume.setOrigin(field.geometry.T_map_grid.translation());
  return volume;
}

}  // namespace ttsdf
