#pragma once
// The two inner loops of the compressed field, each in a portable version and versions for wider vectors,
// chosen at run time. Rows and columns are padded with zeros to a multiple of kColumnPad floats.

#include <vector>

namespace ttsdf {

constexpr int kColumnPad = 16;   ///< floats
constexpr int kColumnBlock = 4;  ///< columns of neighbouring first indices contracted together

/// c[q][:] = sum_a g[q * stride_g + a] * slice[a][:], q < kColumnBlock; a < r1; rows of `width` padded
/// floats.
using ContractKernel = void (*)(const float* g, int stride_g, const float* slice, int r1, int width,
                                float* c);

/// out[c] = dot(columns[c & 3], last[c >> 2]), c < 8, over `width` padded floats.
using DotKernel = void (*)(const float* const columns[4], const float* const last[2], int width, float* out);

struct ColumnKernels {
  ContractKernel contract;
  DotKernel dots;
  const char* name;  ///< "avx512" | "avx2" | "portable"
};

/// What this CPU can run, widest first; the last are the portable ones.
const std::vector<ColumnKernels>& availableColumnKernels();

/// The widest kernels this CPU has, or the portable ones.
const ColumnKernels& columnKernels(bool portable = false);

}  // namespace ttsdf
