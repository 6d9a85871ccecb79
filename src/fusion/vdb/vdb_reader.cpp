#include "vdb_reader.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "ttsdf_localization/readers/child_process.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr openvdb::Index kLeafVoxels = openvdb::FloatTree::LeafNodeType::SIZE;
constexpr std::size_t kMaskBytes = kLeafVoxels / 8;

[[noreturn]] void failVdb(const std::string& path, const std::string& what) {
  throw std::runtime_error("VDB file '" + path + "': " + what);
}

// ---- what crosses the pipe: plain numbers, grid by grid ----

class Sender {
 public:
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    bytes_ += text;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Receiver {
 public:
  explicit Receiver(const std::string& bytes) : next_(bytes.data()), end_(bytes.data() + bytes.size()) {}
  template <class T>
  T get() {
    T value;
    std::memcpy(&value, take(sizeof(value)), sizeof(value));
    return value;
  }
  std::string getText() {
    const auto size = static_cast<std::size_t>(get<std::uint64_t>());
    const char* text = take(size);
    return {text, size};
  }

 private:
  const char* take(std::size_t size) {
    if (static_cast<std::size_t>(end_ - next_) < size) throw std::runtime_error("got less than was promised");
    const char* first = next_;
    next_ += size;
    return first;
  }
  const char *next_, *end_;
};

void putTransform(const openvdb::GridBase& grid, Sender& out) {
  const openvdb::math::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4();
  for (int n = 0; n < 16; ++n) out.put(m.asPointer()[n]);
}

openvdb::math::Transform::Ptr getTransform(Receiver& in) {
  double m[16];
  for (double& x : m) x = in.get<double>();
  const openvdb::math::Mat4d matrix(m);
  for (const double x : m) {
    if (!std::isfinite(x)) throw std::runtime_error("got a transform that is not finite");
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

template <class Tree>
void putTree(const Tree& tree, Sender& out) {
  constexpr bool kIsMask = std::is_same_v<typename Tree::ValueType, bool>;
  const auto asFloat = [](auto value) { return static_cast<float>(value); };
  out.put(asFloat(tree.background()));
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    out.put(char{'L'});
    const Coord origin = leaf->origin();
    for (int axis = 0; axis < 3; ++axis) out.put(static_cast<std::int32_t>(origin[axis]));
    for (openvdb::Index word = 0; word < kMaskBytes / 8; ++word) {
      out.put(leaf->getValueMask().template getWord<std::uint64_t>(word));
    }
    if constexpr (!kIsMask) {
      for (openvdb::Index n = 0; n < kLeafVoxels; ++n) out.put(asFloat(leaf->getValue(n)));
    }
  }
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!tile.isValueOn() && *tile == tree.background()) continue;
    out.put(char{'T'});
    const Coord origin = tile.getBoundingBox().min();
    out.put(static_cast<std::uint8_t>(tile.getLevel()));
    for (int axis = 0; axis < 3; ++axis) out.put(static_cast<std::int32_t>(origin[axis]));
    out.put(static_cast<std::uint8_t>(tile.isValueOn() ? 1 : 0));
    out.put(asFloat(*tile));
  }
  out.put(char{'E'});
}

template <class Tree>
void getTree(Receiver& in, Tree& tree) {
  constexpr bool kIsMask = std::is_same_v<typename Tree::ValueType, bool>;
  using Value = typename Tree::ValueType;
  for (char kind = in.get<char>(); kind != 'E'; kind = in.get<char>()) {
    const std::uint8_t level = kind == 'T' ? in.get<std::uint8_t>() : 0;
    Coord origin;
    for (int axis = 0; axis < 3; ++axis) origin[axis] = in.get<std::int32_t>();
    if (kind == 'T') {
      const bool active = in.get<std::uint8_t>() != 0;
      const auto value = static_cast<Value>(in.get<float>());
      if (level < 1 || level > 3) throw std::runtime_error("got a tile of an unknown level");
      tree.addTile(level, origin, value, active);
      continue;
    }
    auto* leaf = tree.touchLeaf(origin);
    std::uint64_t mask[kMaskBytes / 8];
    for (std::uint64_t& word : mask) word = in.get<std::uint64_t>();
    for (openvdb::Index n = 0; n < kLeafVoxels; ++n) {
      const bool active = (mask[n / 64] >> (n % 64) & 1) != 0;
      if constexpr (kIsMask) {
        leaf->setActiveState(n, active);
      } else {
        const float value = in.get<float>();
        active ? leaf->setValueOn(n, static_cast<Value>(value))
               : leaf->setValueOff(n, static_cast<Value>(value));
      }
    }
  }
}

// ---- in the child ----

struct Listed {
  std::string name, type;
  bool level_set = false;
};

std::string nameList(const std::vector<Listed>& grids) {
  std::string text;
  for (const Listed& grid : grids) {
    text += (text.empty() ? "'" : ", '") + shown(grid.name) + "' (" + grid.type +
            (grid.level_set ? ", level set" : "") + ")";
  }
  return text;
}

bool isReal(const Listed& grid) {
  return grid.type == openvdb::FloatGrid::gridType() || grid.type == openvdb::DoubleGrid::gridType();
}

/// Place of the grid that is meant.
std::size_t choose(const std::string& path, const std::vector<Listed>& grids, const std::string& wanted) {
  std::vector<std::size_t> real, level_sets, named;
  for (std::size_t n = 0; n < grids.size(); ++n) {
    if (isReal(grids[n])) real.push_back(n);
    if (isReal(grids[n]) && grids[n].level_set) level_sets.push_back(n);
    if (grids[n].name == wanted) named.push_back(n);
  }
  if (!wanted.empty()) {
    if (named.size() == 1 && isReal(grids[named[0]])) return named[0];
    failVdb(path, "got " + std::to_string(named.size()) + " grids '" + wanted +
                      "', wanted one of real numbers; there are: " + nameList(grids));
  }
  if (real.empty()) {
    failVdb(path, "got " + std::to_string(grids.size()) + " grids and none of real numbers" +
                      (grids.empty() ? "" : ": " + nameList(grids)));
  }
  if (real.size() == 1) return real[0];
  if (level_sets.size() == 1) return level_sets[0];
  failVdb(path, "got several grids, choose one with --grid NAME: " + nameList(grids));
}

template <class Grid>
void putGrid(const openvdb::GridBase::Ptr& base, Sender& out) {
  const auto grid = openvdb::gridPtrCast<Grid>(base);
  if (!grid) throw std::runtime_error("got a grid of another type than its metadata say");
  putTransform(*grid, out);
  out.put(static_cast<std::int32_t>(grid->getGridClass()));
  putTree(grid->tree(), out);
}

template <class T>
T metaOr(const openvdb::GridBase& grid, const char* key, T otherwise) {
  try {
    return grid.metaValue<T>(key);
  } catch (const openvdb::Exception&) {
    return otherwise;
  }
}

std::string load(const std::string& path, const std::string& wanted) {
  openvdb::io::File file(path);
  file.open(false);  // no delayed loading: the file may change or go away
  std::vector<Listed> grids;
  bool own = false;
  const auto headers = file.readAllGridMetadata();
  for (const auto& header : *headers) {
    grids.push_back({header->getName(), header->type(), header->getGridClass() == openvdb::GRID_LEVEL_SET});
    own = own || (grids.back().name == "tsdf" && (*header)[kVdbVersionKey]);
  }
  own = own && (wanted.empty() || wanted == "tsdf");
  Sender out;
  const auto read = [&file, &path](const std::string& name) {
    const auto grid = file.readGrid(name);
    if (!grid) failVdb(path, "got no grid '" + name + "', though it says to be a saved volume");
    return grid;
  };
  if (own) {
    const auto tsdf = read("tsdf");
    out.put(static_cast<std::int32_t>(metaOr<openvdb::Int32>(*tsdf, kVdbVersionKey, -1)));
    out.put(metaOr<double>(*tsdf, kVdbVoxelSizeKey, 0.0));
    out.put(metaOr<double>(*tsdf, kVdbTruncationKey, 0.0));
    out.put(static_cast<std::int64_t>(metaOr<openvdb::Int64>(*tsdf, kVdbFramesKey, 0)));
    const auto origin = metaOr<openvdb::Vec3d>(*tsdf, kVdbOriginKey, openvdb::Vec3d(0.0));
    for (int axis = 0; axis < 3; ++axis) out.put(origin[axis]);
    out.put(std::string());
    out.put(std::string("tsdf"));
    putGrid<openvdb::FloatGrid>(tsdf, out);
    putGrid<openvdb::FloatGrid>(read("weight"), out);
    putGrid<openvdb::MaskGrid>(read("free"), out);
    return out.take();
  }
  const Listed chosen = grids[choose(path, grids, wanted)];
  out.put(std::int32_t{0});
  out.put(0.0);
  out.put(0.0);
  out.put(std::int64_t{0});
  for (int axis = 0; axis < 3; ++axis) out.put(0.0);
  out.put(grids.size() > 1 && wanted.empty() ? "VDB file '" + path + "': takes grid '" + shown(chosen.name) +
                                                   "' of " + nameList(grids) + "; --grid NAME takes another"
                                             : std::string());
  out.put(chosen.name);
  const auto base = file.readGrid(chosen.name);
  if (!base->transform().isLinear())
    failVdb(path, "grid '" + shown(chosen.name) + "': got a transform that is not linear");
  chosen.type == openvdb::FloatGrid::gridType() ? putGrid<openvdb::FloatGrid>(base, out)
                                                : putGrid<openvdb::DoubleGrid>(base, out);
  return out.take();
}

template <class Grid>
typename Grid::Ptr getGrid(Receiver& in) {
  const auto transform = getTransform(in);
  const std::int32_t grid_class = in.get<std::int32_t>();
  const auto background = static_cast<typename Grid::ValueType>(in.get<float>());
  auto grid = Grid::create(background);
  grid->setTransform(transform);
  // OpenVDB's tools turn the surface of what is no level set.
  if (grid_class == openvdb::GRID_LEVEL_SET) grid->setGridClass(openvdb::GRID_LEVEL_SET);
  getTree(in, grid->tree());
  return grid;
}

}  // namespace

VdbFileGrids readVdbFile(const std::string& path, const std::string& grid) {
  if (!std::filesystem::exists(path)) failVdb(path, "no such file");
  if (!std::filesystem::is_regular_file(path)) failVdb(path, "is no regular file");
  const std::string bytes = runInChild("VDB file '" + path + "'", limitsForFile(path), [&] {
    try {
      return load(path, grid);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      const std::string text = error.what();
      if (text.rfind("VDB file", 0) == 0) throw;
      failVdb(path, "cannot be read (" + shown(text) + ")");
    }
  });
  VdbFileGrids result;
  try {
    Receiver in(bytes);
    result.version = in.get<std::int32_t>();
    result.voxel_size = in.get<double>();
    result.truncation = in.get<double>();
    result.frames = in.get<std::int64_t>();
    for (int axis = 0; axis < 3; ++axis) result.origin[axis] = in.get<double>();
    result.note = in.getText();
    const std::string name = in.getText();
    result.distance = getGrid<openvdb::FloatGrid>(in);
    result.distance->setName(name);
    if (result.version != 0) {
      result.weight = getGrid<openvdb::FloatGrid>(in);
      result.weight->setName("weight");
      result.free = getGrid<openvdb::MaskGrid>(in);
      result.free->setName("free");
      result.distance->setGridClass(openvdb::GRID_LEVEL_SET);
    }
  } catch (const std::exception& error) {
    failVdb(path, std::string("cannot be read (") + shown(error.what()) + ")");
  }
  return result;
}

}  // namespace ttsdf
