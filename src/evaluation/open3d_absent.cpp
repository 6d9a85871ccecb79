// Takes the place of open3d_methods.cpp where Open3D is not installed.

#include <stdexcept>

#include "ttsdf_localization/evaluation/method.h"

namespace ttsdf {

bool hasOpen3d() { return false; }

std::unique_ptr<Method> makeOpen3dMethod(const std::string& kind, const MapCloud&,
                                         const CloudMethodOptions&) {
  throw std::runtime_error("method '" + kind +
                           "': got a build without Open3D, wanted one made with libopen3d-dev installed");
}

}  // namespace ttsdf
