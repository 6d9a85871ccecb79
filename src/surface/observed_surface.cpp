#include "ttsdf_localization/surface/observed_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sharp_edges.h"

namespace ttsdf {
namespace {

struct Crossing {
  Eigen::Array3i voxel;  ///< lower end of the grid edge
  int axis;
  float share;  ///< of the edge from its lower end
  bool falls;   ///< positive at the lower end
};

bool crosses(const ObservedGrid& grid, std::size_t a, std::size_t b) {
  return grid.state[a] == Observation::kBand && grid.state[b] == Observation::kBand &&
         (grid.tsdf[a] < 0.0F) != (grid.tsdf[b] < 0.0F);
}

/// Crossings of all edges that have four cells around them.
std::vector<Crossing> findCrossings(const ObservedGrid& grid) {
  const std::array<std::size_t, 3> stride{
      1, static_cast<std::size_t>(grid.dims[0]),
      static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1])};
  std::vector<Crossing> crossings;
  for (int k = 0; k + 1 < grid.dims[2]; ++k) {
    for (int j = 0; j + 1 < grid.dims[1]; ++j) {
      for (int i = 0; i + 1 < grid.dims[0]; ++i) {
        const std::size_t a = grid.offset(i, j, k);
        if (grid.state[a] != Observation::kBand) continue;
        const Eigen::Array3i voxel(i, j, k);
        for (int axis = 0; axis < 3; ++axis) {
          const std::size_t b = a + stride[static_cast<std::size_t>(axis)];
          if (!crosses(grid, a, b)) continue;
          if (voxel[(axis + 1) % 3] == 0 || voxel[(axis + 2) % 3] == 0) continue;
          const float fa = grid.tsdf[a], fb = grid.tsdf[b];
          crossings.push_back({voxel, axis, fa / (fa - fb), fa >= 0.0F});
        }
      }
    }
  }
  return crossings;
}

/// The four cells around a crossing, counter-clockwise seen from the upper end of its edge.
std::array<std::size_t, 4> cellsAround(const ObservedGrid& grid, const Crossing& crossing) {
  const int u = (crossing.axis + 1) % 3, v = (crossing.axis + 2) % 3;
  Eigen::Array3i cell = crossing.voxel;
  std::array<std::size_t, 4> cells{};
  const auto offset = [&] { return grid.offset(cell[0], cell[1], cell[2]); };
  cell[u] -= 1, cell[v] -= 1;
  cells[0] = offset();
  cell[u] += 1;
  cells[1] = offset();
  cell[v] += 1;
  cells[2] = offset();
  cell[u] -= 1;
  cells[3] = offset();
  return cells;
}

/// Vertices of the dual mesh: the mean of the crossings around every crossed cell. Fills `vertex_of_cell`.
std::vector<Eigen::Vector3f> placeVertices(const ObservedGrid& grid, const std::vector<Crossing>& crossings,
                                           std::vector<std::int32_t>& vertex_of_cell) {
  vertex_of_cell.assign(grid.size(), -1);
  std::vector<Eigen::Vector3f> vertices;
  std::vector<float> counts;
  for (const auto& crossing : crossings) {
    Eigen::Vector3f point = crossing.voxel.cast<float>();
    point[crossing.axis] += crossing.share;
    for (const std::size_t cell : cellsAround(grid, crossing)) {
      auto& vertex = vertex_of_cell[cell];
      if (vertex < 0) {
        vertex = static_cast<std::int32_t>(vertices.size());
        vertices.emplace_back(Eigen::Vector3f::Zero());
        counts.push_back(0.0F);
      }
      vertices[static_cast<std::size_t>(vertex)] += point;
      counts[static_cast<std::size_t>(vertex)] += 1.0F;
    }
  }
  for (std::size_t n = 0; n < vertices.size(); ++n) vertices[n] /= counts[n];
  return vertices;
}

/// One quadrilateral per crossing, counter-clockwise seen from free space.
Quads joinCells(const ObservedGrid& grid, const std::vector<Crossing>& crossings,
                const std::vector<std::int32_t>& vertex_of_cell) {
  Quads quads;
  quads.reserve(crossings.size());
  for (const auto& crossing : crossings) {
    const auto cells = cellsAround(grid, crossing);
    std::array<int, 4> q{};
    for (std::size_t c = 0; c < 4; ++c) q[c] = vertex_of_cell[cells[c]];
    // Counter-clockwise around the edge points up the axis: turn it where free space is below.
    if (crossing.falls) std::swap(q[1], q[3]);
    quads.push_back(q);
  }
  return quads;
}

/// Two triangles per quadrilateral, along the sharp edge if one runs through it, else along the shorter
/// diagonal.
std::vector<Eigen::Vector3i> split(const std::vector<Eigen::Vector3f>& vertices, const Quads& quads,
                                   const std::vector<std::uint8_t>& sharp) {
  std::vector<Eigen::Vector3i> triangles;
  triangles.reserve(2 * quads.size());
  for (const auto& q : quads) {
    const auto at = [&](std::size_t c) -> const Eigen::Vector3f& {
      return vertices[static_cast<std::size_t>(q[c])];
    };
    const auto is_sharp = [&](std::size_t c) { return sharp[static_cast<std::size_t>(q[c])] != 0; };
    const bool first_sharp = is_sharp(0) && is_sharp(2), second_sharp = is_sharp(1) && is_sharp(3);
    const bool first = first_sharp != second_sharp
                           ? first_sharp
                           : (at(0) - at(2)).squaredNorm() <= (at(1) - at(3)).squaredNorm();
    if (first) {
      triangles.emplace_back(q[0], q[1], q[2]);
      triangles.emplace_back(q[0], q[2], q[3]);
    } else {
      triangles.emplace_back(q[1], q[2], q[3]);
      triangles.emplace_back(q[1], q[3], q[0]);
    }
  }
  return triangles;
}

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int a) {
    while (parent_[static_cast<std::size_t>(a)] != a) {
      parent_[static_cast<std::size_t>(a)] =
          parent_[static_cast<std::size_t>(parent_[static_cast<std::size_t>(a)])];
      a = parent_[static_cast<std::size_t>(a)];
    }
    return a;
  }
  void join(int a, int b) { parent_[static_cast<std::size_t>(find(a))] = find(b); }

 private:
  std::vector<int> parent_;
};

/// 1 for vertices in the outermost cells.
std::vector<std::uint8_t> verticesAtRim(const ObservedGrid& grid,
                                        const std::vector<Eigen::Vector3f>& vertices) {
  const Eigen::Array3f last = (grid.dims - 2).cast<float>();
  std::vector<std::uint8_t> at_rim(vertices.size());
  for (std::size_t n = 0; n < vertices.size(); ++n)
    at_rim[n] = (vertices[n].array() <= 1.0F).any() || (vertices[n].array() >= last).any() ? 1 : 0;
  return at_rim;
}

/// Triangles of the pieces with at least `min_component` vertices or one that `counts_as_large` (may be
/// empty); vertices without triangle are dropped.
SurfaceMesh keepLargePieces(const std::vector<Eigen::Vector3f>& vertices,
                            const std::vector<Eigen::Vector3i>& triangles, int min_component,
                            const std::vector<std::uint8_t>& counts_as_large) {
  DisjointSets pieces(vertices.size());
  for (const auto& t : triangles) pieces.join(t[0], t[1]), pieces.join(t[1], t[2]);
  std::vector<int> size(vertices.size(), 0), renumbered(vertices.size(), -1);
  for (std::size_t n = 0; n < vertices.size(); ++n)
    size[static_cast<std::size_t>(pieces.find(static_cast<int>(n)))] +=
        !counts_as_large.empty() && counts_as_large[n] ? min_component : 1;

  SurfaceMesh mesh;
  int vertex_count = 0;
  std::vector<Eigen::Vector3i> kept;
  for (Eigen::Vector3i t : triangles) {
    if (size[static_cast<std::size_t>(pieces.find(t[0]))] < min_component) continue;
    for (int corner = 0; corner < 3; ++corner) {
      int& number = renumbered[static_cast<std::size_t>(t[corner])];
      if (number < 0) number = vertex_count++;
      t[corner] = number;
    }
    kept.push_back(t);
  }
  mesh.vertices.resize(3, vertex_count);
  for (std::size_t n = 0; n < vertices.size(); ++n) {
    if (renumbered[n] >= 0) mesh.vertices.col(renumbered[n]) = vertices[n];
  }
  mesh.triangles.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t n = 0; n < kept.size(); ++n) mesh.triangles.col(static_cast<Eigen::Index>(n)) = kept[n];
  return mesh;
}

/// Vertices with nothing but slivers around them keep a zero normal, not NaN.
void normalizeColumns(Eigen::Matrix3Xf& vectors) {
  for (Eigen::Index n = 0; n < vectors.cols(); ++n) {
    const float length = vectors.col(n).norm();
    if (length > 0.0F) vectors.col(n) /= length;
  }
}

Eigen::Matrix3Xf vertexNormals(const SurfaceMesh& mesh, int smoothing) {
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, mesh.vertices.cols());
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3i t = mesh.triangles.col(n);
    const Eigen::Vector3f a = mesh.vertices.col(t[0]);
    // Not normalised: weighted with the area.
    const Eigen::Vector3f normal = (mesh.vertices.col(t[1]) - a).cross(mesh.vertices.col(t[2]) - a);
    for (int c = 0; c < 3; ++c) normals.col(t[c]) += normal;
  }
  normalizeColumns(normals);
  for (int pass = 0; pass < smoothing; ++pass) {
    Eigen::Matrix3Xf sum = normals;
    for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
      const Eigen::Vector3i t = mesh.triangles.col(n);
      const Eigen::Vector3f total = normals.col(t[0]) + normals.col(t[1]) + normals.col(t[2]);
      for (int c = 0; c < 3; ++c) sum.col(t[c]) += total;
    }
    normalizeColumns(sum);
    normals = sum;
  }
  return normals;
}

/// Marks the edges that only one triangle uses. Edges are gathered by their lower vertex: a handful each.
void markBorders(const SurfaceMesh& mesh, ObservedSurface& surface) {
  struct Edge {
    int high;
    std::uint32_t triangle;
    std::uint8_t number;
  };
  const auto forEachEdge = [&mesh](const auto& fn) {
    for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
      for (int e = 0; e < 3; ++e) {
        const int a = mesh.triangles(e, n), b = mesh.triangles((e + 1) % 3, n);
        fn(static_cast<std::size_t>(std::min(a, b)), std::max(a, b), n, e);
      }
    }
  };
  std::vector<std::uint32_t> start(static_cast<std::size_t>(mesh.vertices.cols()) + 2, 0);
  forEachEdge([&](std::size_t low, int, Eigen::Index, int) { ++start[low + 2]; });
  for (std::size_t n = 2; n < start.size(); ++n) start[n] += start[n - 1];
  std::vector<Edge> edges(start.back());
  forEachEdge([&](std::size_t low, int high, Eigen::Index triangle, int number) {
    edges[start[low + 1]++] = {high, static_cast<std::uint32_t>(triangle), static_cast<std::uint8_t>(number)};
  });
  for (std::size_t low = 0; low + 2 < start.size(); ++low) {
    for (std::uint32_t n = start[low]; n < start[low + 1]; ++n) {
      const Edge& edge = edges[n];
      const auto same = std::count_if(edges.begin() + start[low], edges.begin() + start[low + 1],
                                      [&](const Edge& other) { return other.high == edge.high; });
      if (same != 1) continue;
      surface.border_edges[edge.triangle] |= static_cast<std::uint8_t>(1U << edge.number);
      surface.border_vertex[low] = 1;
      surface.border_vertex[static_cast<std::size_t>(edge.high)] = 1;
    }
  }
}

}  // namespace

ObservedSurface observedSurface(const ObservedGrid& grid, int min_component, int threads, bool keep_cut) {
  check(grid);
  const std::vector<Crossing> crossings = findCrossings(grid);
  std::vector<std::int32_t> vertex_of_cell;
  std::vector<Eigen::Vector3f> vertices = placeVertices(grid, crossings, vertex_of_cell);
  const std::vector<std::uint8_t> at_rim =
      keep_cut ? verticesAtRim(grid, vertices) : std::vector<std::uint8_t>();
  const Quads quads = joinCells(grid, crossings, vertex_of_cell);
  const std::vector<std::uint8_t> sharp = sharpenEdges(vertices, quads, threads);
  const std::vector<Eigen::Vector3i> triangles = split(vertices, quads, sharp);
  SurfaceMesh mesh = keepLargePieces(vertices, triangles, min_component, at_rim);
  mesh.vertices.colwise() += grid.origin.cast<float>().matrix();
  mesh.vertices *= static_cast<float>(grid.voxel_size);
  return describeSurface(std::move(mesh), 2);
}

ObservedSurface describeSurface(SurfaceMesh mesh, int normal_smoothing) {
  ObservedSurface surface;
  surface.normals = vertexNormals(mesh, normal_smoothing);
  const auto triangle_count = static_cast<std::size_t>(mesh.triangles.cols());
  surface.border_edges.assign(triangle_count, 0);
  surface.border_vertex.assign(static_cast<std::size_t>(mesh.vertices.cols()), 0);

  markBorders(mesh, surface);
  surface.mesh = std::move(mesh);
  return surface;
}

}  // namespace ttsdf
