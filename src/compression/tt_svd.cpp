#include "ttsdf_localization/compression/tt_svd.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "../tensor/gemm.h"
#include "../tensor/slab_parts.h"
#include "gram.h"

namespace ttsdf {

namespace {

struct Subspace {
  Eigen::MatrixXd basis;         // orthonormal columns, largest singular value first
  std::vector<double> spectrum;  // all singular values
  double discarded = 0.0;        // sum of squares cut off
};

void checkOptions(const TtSvdOptions& options) {
  if (options.max_rank1 < 0 || options.max_rank2 < 0 || !(options.tolerance >= 0.0) || options.threads < 1) {
    std::ostringstream text;
    text << "ttSvd: got ranks " << options.max_rank1 << ", " << options.max_rank2 << ", tolerance "
         << options.tolerance << " and " << options.threads
         << " threads, wanted none negative and at least one thread";
    throw std::invalid_argument(text.str());
  }
}

void checkExtents(const Dims& dims, const ModeOrder& axes) {
  const bool permutation = std::is_permutation(axes.begin(), axes.end(), ModeOrder{{0, 1, 2}}.begin());
  if ((dims >= 1).all() && permutation) return;
  std::ostringstream text;
  text << "ttSvd: got extents " << dims.transpose() << " and mode order " << axes[0] << axes[1] << axes[2]
       << ", wanted extents >= 1 and a permutation of 012";
  throw std::invalid_argument(text.str());
}

/// Leading left singular vectors from the Gram matrix (lower triangle) of a matrix of `columns` columns.
/// `allowed` is the sum of squares that may go.
Subspace leadingSubspace(const Eigen::MatrixXd& gram, Eigen::Index columns, int max_rank, double allowed) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);  // reads the lower triangle
  if (solver.info() != Eigen::Success) throw std::runtime_error("ttSvd: the eigensolver did not converge");
  const int n = static_cast<int>(gram.rows());
  Subspace subspace;
  for (int k = 0; k < n; ++k)
    subspace.spectrum.push_back(std::sqrt(std::max(0.0, solver.eigenvalues()[n - 1 - k])));
  const double floor = 1e-8 * subspace.spectrum.front();  // below, a Gram matrix holds rounding only
  int rank = n;
  while (rank > 1) {
    const double next = subspace.spectrum[static_cast<std::size_t>(rank - 1)];
    const bool noise = next <= floor || rank > columns;
    const bool over = max_rank > 0 && rank > max_rank;
    const bool spare = subspace.discarded + next * next <= allowed;
    if (!noise && !over && !spare) break;
    subspace.discarded += next * next;
    --rank;
  }
  subspace.basis = solver.eigenvectors().rightCols(rank).rowwise().reverse();
  return subspace;
}

double squaredNorm(const Eigen::MatrixXd& gram) { return gram.trace(); }

/// Gram matrices summed over slabs on several threads.
class SlabSums {
 public:
  SlabSums(int slabs, int threads) : slabs_(slabs), threads_(std::min(threads, slabs)) {}

  /// Sum of A A^T over the slabs; prepare(j, A) makes A of `rows` rows from slab j, on any thread.
  template <class Prepare>
  Eigen::MatrixXd gram(int rows, const Prepare& prepare) const {
    const int parts = threads_ > 1 ? kSlabParts : 1;
    std::vector<Eigen::MatrixXd> sums(static_cast<std::size_t>(parts));
    overParts(slabs_, parts, threads_, [&](int part, int begin, int end) {
      Eigen::MatrixXd& sum = sums[static_cast<std::size_t>(part)];
      sum = Eigen::MatrixXd::Zero(rows, rows);
      Eigen::MatrixXf slab;
      for (int j = begin; j < end; ++j) {
        prepare(j, slab);
        addGram(slab, sum);
      }
    });
    for (std::size_t part = 1; part < sums.size(); ++part) {
      if (sums[part].size() > 0)
        sums[0] = sums[0].size() > 0 ? Eigen::MatrixXd(sums[0] + sums[part]) : sums[part];
    }
    return sums[0];
  }

 private:
  int slabs_, threads_;
};

}  // namespace

TtSvdResult ttSvd(const Dims& dims, const SlabSource& source, const TtSvdOptions& options) {
  checkOptions(options);
  const ModeOrder axes = options.axes.value_or(defaultModeOrder(dims));
  checkExtents(dims, axes);
  const int n1 = dims[axes[0]], n2 = dims[axes[1]], n3 = dims[axes[2]];

  const SlabSums sums(n2, options.threads);
  const Eigen::MatrixXd gram = sums.gram(n1, [&](int j, Eigen::MatrixXf& slab) {
    slab.resize(n1, n3);
    source(j, slab);
    if (!slab.allFinite()) {
      throw std::invalid_argument("ttSvd: got NaN or infinite entries at middle index " + std::to_string(j) +
                                  ", wanted finite ones");
    }
  });
  const double total = squaredNorm(gram);
  // Both truncations share the allowed error evenly (Oseledets 2011, Theorem 2.2).
  const double allowed = 0.5 * options.tolerance * options.tolerance * total;

  TtSvdResult result;
  Subspace left = leadingSubspace(gram, static_cast<Eigen::Index>(n2) * n3, options.max_rank1, allowed);
  const int r1 = static_cast<int>(left.basis.cols());
  const Eigen::MatrixXf first = left.basis.cast<float>();

  Eigen::MatrixXf projected(r1, static_cast<Eigen::Index>(n2) * n3);  // block j: r1 x n3
  const Eigen::MatrixXf first_t = first.transpose();
  const Eigen::MatrixXd gram3 = sums.gram(n3, [&](int j, Eigen::MatrixXf& slab) {
    slab.resize(n1, n3);
    source(j, slab);
    auto block = projected.middleCols(static_cast<Eigen::Index>(j) * n3, n3);
    gemm(first_t, slab, block);
    slab = block.transpose();
  });
  Subspace right = leadingSubspace(gram3, static_cast<Eigen::Index>(r1) * n2, options.max_rank2, allowed);
  const int r2 = static_cast<int>(right.basis.cols());
  const Eigen::MatrixXf last = right.basis.cast<float>().transpose();

  Eigen::MatrixXf middle(r1, static_cast<Eigen::Index>(n2) * r2);
  for (int j = 0; j < n2; ++j) {
    middle.middleCols(static_cast<Eigen::Index>(j) * r2, r2).noalias() =
        projected.middleCols(static_cast<Eigen::Index>(j) * n3, n3) * last.transpose();
  }
  result.relative_error = total > 0.0 ? std::sqrt((left.discarded + right.discarded) / total) : 0.0;
  result.train = TensorTrain(axes, first, std::move(middle), last);
  result.spectrum1 = std::move(left.spectrum);
  result.spectrum2 = std::move(right.spectrum);
  return result;
}

TtSvdResult ttSvd(const DenseTensor& tensor, const TtSvdOptions& options) {
  const Dims& dims = tensor.dims();
  const ModeOrder axes = options.axes.value_or(defaultModeOrder(dims));
  checkExtents(dims, axes);
  const auto stride = [&dims](int axis) {
    Eigen::Index s = 1;
    for (int a = 0; a < axis; ++a) s *= dims[a];
    return s;
  };
  const Eigen::Index s1 = stride(axes[0]), s2 = stride(axes[1]), s3 = stride(axes[2]);
  using StridedMap = Eigen::Map<const Eigen::MatrixXf, 0, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;
  const SlabSource source = [&](int j, Eigen::Ref<Eigen::MatrixXf> slab) {
    slab = StridedMap(tensor.data() + j * s2, dims[axes[0]], dims[axes[2]],
                      Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>(s3, s1));
  };
  return ttSvd(dims, source, options);
}

TensorTrain round(const TensorTrain& tt, const TtSvdOptions& options) {
  // F = Q1 (R1 G2 R3) Q3 with orthonormal Q: the small core R1 G2 R3 holds all of the error's geometry.
  const Eigen::HouseholderQR<Eigen::MatrixXf> qr1(tt.first());
  const Eigen::HouseholderQR<Eigen::MatrixXf> qr3(tt.last().transpose().eval());
  const auto sizes = tt.modeSizes();
  const Eigen::Index m1 = std::min<Eigen::Index>(sizes[0], tt.rank1()),
                     m3 = std::min<Eigen::Index>(sizes[2], tt.rank2());
  const Eigen::MatrixXf Q1 = qr1.householderQ() * Eigen::MatrixXf::Identity(sizes[0], m1);
  const Eigen::MatrixXf Q3 = qr3.householderQ() * Eigen::MatrixXf::Identity(sizes[2], m3);
  const Eigen::MatrixXf R1 = Q1.transpose() * tt.first();
  const Eigen::MatrixXf R3 = Q3.transpose() * tt.last().transpose();
  const SlabSource source = [&](int j, Eigen::Ref<Eigen::MatrixXf> slab) {
    slab = R1 * tt.slice(j) * R3.transpose();
  };
  TtSvdOptions small = options;
  small.axes = ModeOrder{{0, 1, 2}};
  const TensorTrain core =
      ttSvd(Dims(static_cast<int>(m1), sizes[1], static_cast<int>(m3)), source, small).train;
  return TensorTrain(tt.axes(), Q1 * core.first(), core.middle(), core.last() * Q3.transpose());
}

}  // namespace ttsdf
