#pragma once
// Ray parameter of the first hit with a primitive in its own frame, branch-free. `Real` is double for a
// single ray, or a vector of doubles (GCC and clang vector extension) for neighbouring pixels: the operators
// used here are the same.

#include <cmath>
#include <limits>

// Vectors cross a call differently with and without AVX: none of these functions may stay a call.
#define TTSDF_ALWAYS_INLINE inline __attribute__((always_inline))

namespace ttsdf::ray_kernels {

constexpr double kMiss = std::numeric_limits<double>::infinity();
/// Stands in for a zero direction component: far below any real one, yet its inverse times a scene's size is
/// finite.
constexpr double kTiny = 1e-200;

template <class Real>
struct Vec {
  Real x, y, z;
};

template <class Real>
TTSDF_ALWAYS_INLINE Real broadcast(double value) {
  return value + Real{};
}
template <class Real>
TTSDF_ALWAYS_INLINE Real lower(const Real& a, const Real& b) {
  return a < b ? a : b;
}
template <class Real>
TTSDF_ALWAYS_INLINE Real higher(const Real& a, const Real& b) {
  return a > b ? a : b;
}
template <class Real>
TTSDF_ALWAYS_INLINE Real absolute(const Real& a) {
  return a < 0.0 ? -a : a;
}
template <class Real>
TTSDF_ALWAYS_INLINE Real inverse(const Real& d) {
  return 1.0 / (absolute(d) < kTiny ? broadcast<Real>(kTiny) : d);
}
TTSDF_ALWAYS_INLINE double squareRoot(const double& a) { return std::sqrt(a); }
template <class Real>
TTSDF_ALWAYS_INLINE Real squareRoot(const Real& a) {
  Real root = a;
  for (unsigned i = 0; i < sizeof(Real) / sizeof(double); ++i) root[i] = std::sqrt(a[i]);
  return root;
}

/// The interval [near, far] in which a ray is inside a primitive -> the hit seen from outside.
template <class Real>
TTSDF_ALWAYS_INLINE Real firstHit(const Real& near, const Real& far) {
  return ((near <= far) & (near > 0.0)) ? near : broadcast<Real>(kMiss);
}

/// Box of half sides `h` around the origin; ray o + t d.
struct Box {
  template <class Real>
  static TTSDF_ALWAYS_INLINE Real firstHit(const Vec<double>& o, const Vec<Real>& d, const Vec<double>& h) {
    const Real ix = inverse(d.x), iy = inverse(d.y), iz = inverse(d.z);
    const Real mx = -o.x * ix, my = -o.y * iy, mz = -o.z * iz;
    const Real kx = absolute(ix) * h.x, ky = absolute(iy) * h.y, kz = absolute(iz) * h.z;
    const Real near = higher<Real>(higher<Real>(mx - kx, my - ky), mz - kz);
    const Real far = lower<Real>(lower<Real>(mx + kx, my + ky), mz + kz);
    return ray_kernels::firstHit(near, far);
  }
};

/// Cylinder about z: h = (radius, radius, half height).
struct Cylinder {
  template <class Real>
  static TTSDF_ALWAYS_INLINE Real firstHit(const Vec<double>& o, const Vec<Real>& d, const Vec<double>& h) {
    const Real a = higher<Real>(d.x * d.x + d.y * d.y, broadcast<Real>(kTiny));
    const Real b = o.x * d.x + o.y * d.y;
    const double c = o.x * o.x + o.y * o.y - h.x * h.x;
    const Real discriminant = b * b - a * c;
    const Real root = squareRoot(higher<Real>(discriminant, broadcast<Real>(0.0)));
    const Real iz = inverse(d.z);
    const Real mz = -o.z * iz, kz = absolute(iz) * h.z;
    const Real near = higher<Real>((-b - root) / a, mz - kz);
    const Real far = lower<Real>((-b + root) / a, mz + kz);
    return discriminant < 0.0 ? broadcast<Real>(kMiss) : ray_kernels::firstHit(near, far);
  }
};

/// Sphere: h.x = radius.
struct Sphere {
  template <class Real>
  static TTSDF_ALWAYS_INLINE Real firstHit(const Vec<double>& o, const Vec<Real>& d, const Vec<double>& h) {
    const Real a = d.x * d.x + d.y * d.y + d.z * d.z;
    const Real b = o.x * d.x + o.y * d.y + o.z * d.z;
    const double c = o.x * o.x + o.y * o.y + o.z * o.z - h.x * h.x;
    const Real discriminant = b * b - a * c;
    const Real root = squareRoot(higher<Real>(discriminant, broadcast<Real>(0.0)));
    return discriminant < 0.0 ? broadcast<Real>(kMiss)
                              : ray_kernels::firstHit<Real>((-b - root) / a, (-b + root) / a);
  }
};

}  // namespace ttsdf::ray_kernels
