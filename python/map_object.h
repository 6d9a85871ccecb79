#pragma once
// A map as Python has it: what it says, the bytes of its file, and its field.

#include <cstdint>
#include <memory>
#include <vector>

#include "arguments.h"
#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf::python {

class MapObject {
 public:
  MapObject(TtSdfMap map, std::vector<std::uint8_t> bytes);
  /// Throws std::runtime_error and MapFormatError naming the file.
  static std::unique_ptr<MapObject> load(const py::object& file);
  void save(const py::object& file) const;

  const TtSdfMap& map() const { return map_; }
  const std::shared_ptr<const DistanceField>& field() const { return field_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  TtSdfMap map_;
  std::vector<std::uint8_t> bytes_;
  std::shared_ptr<const DistanceField> field_;
};

}  // namespace ttsdf::python
