#pragma once
// Methods from one line of text, so that a comparison is written on the command line:
//   [label=]kind[:key=value,key=value...]
//   track   ours=track:map=a.ttsdf   paper=track:map=edt.ttsdf,interpolation=nearest,method=gauss_newton gicp

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

struct MethodSpec {
  std::string label;  ///< default: the spec itself, with blanks for commas
  std::string kind;   ///< prior | track | search | global | paper | icp | icp_plane | gicp | ndt | open3d_icp
                      ///< | open3d_icp_plane | fgr | ransac
  /// For the field methods: map=FILE, interpolation=nearest|trilinear, dense=true (the decompressed field),
  /// for kind paper cores=true (nothing decoded, cores of the derivatives as in the paper),
  /// and every option of registration, search and global localization. For the cloud methods: their options.
  std::vector<std::pair<std::string, std::string>> settings;
};

/// Throws std::invalid_argument.
MethodSpec parseMethodSpec(const std::string& text);

struct MethodDefaults {
  std::string map;  ///< path of the map, where a spec names none
  std::function<MapCloud()>
      map_cloud;  ///< the point cloud map; asked once, by the first method that needs it
  Eigen::Vector3d map_down{0.0, 0.0, -1.0};
  RegistrationOptions registration;
  SearchOptions search;
  GlobalOptions global;
  CloudMethodOptions cloud;
};

class MethodFactory {
 public:
  explicit MethodFactory(MethodDefaults defaults) : defaults_(std::move(defaults)) {}
  /// Throws std::invalid_argument for a bad spec, std::runtime_error for a map that cannot be read.
  std::unique_ptr<Method> make(const MethodSpec& spec);

 private:
  std::unique_ptr<Method> makeFieldMethod(const MethodSpec& spec);
  std::unique_ptr<Method> makeCloudMethodFrom(const MethodSpec& spec);
  MethodDefaults defaults_;
  std::unique_ptr<MapCloud> map_cloud_;
};

}  // namespace ttsdf
