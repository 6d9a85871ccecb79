#pragma once
// Loops marked TTSDF_VECTORIZE are compiled several times and the widest version that the CPU has is chosen
// at load time: by feature levels, because "arch=haswell" would match that one processor only. No -march
// flag: types shared with Eigen and PCL of other packages keep their layout.
//
// Note: a marked function must not inline Eigen code (its vector width would differ from the rest of the
// program).

// Not with the thread sanitizer: the choice is made before it is ready.
#if !defined(__x86_64__) || !defined(__GNUC__) || defined(__clang__) || defined(__SANITIZE_THREAD__)
#define TTSDF_VECTORIZE __attribute__((noinline))  // one version, with a name that scripts/cross_arm64 finds
#elif __GNUC__ >= 12
#define TTSDF_VECTORIZE \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"), optimize("O3")))
#else  // knows no levels: without fused multiply-add
#define TTSDF_VECTORIZE __attribute__((target_clones("avx512f", "avx2", "default"), optimize("O3")))
#endif

// Before a loop whose iterations do not depend on each other, though the compiler could not know.
#if defined(__clang__)
#define TTSDF_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define TTSDF_INDEPENDENT _Pragma("GCC ivdep")
#else
#define TTSDF_INDEPENDENT
#endif
