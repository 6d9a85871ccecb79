#pragma once
// Loops marked TTSDF_VECTORIZE are compiled several times and the widest version that the CPU has is chosen
// at load time. No -march flag: types shared with Eigen and PCL of other packages keep their layout.
//
// Note: a marked function must not inline Eigen code (its vector width would differ from the rest of the
// program).

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TTSDF_VECTORIZE \
  __attribute__((target_clones("arch=skylake-avx512", "arch=haswell", "default"), optimize("O3")))
#else
#define TTSDF_VECTORIZE
#endif
