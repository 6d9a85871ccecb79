#include "ttsdf_localization/evaluation/perturbation.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Not std::uniform_real_distribution: its sequence differs between standard libraries.
double uniform(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0; }

// Uniform on the sphere: height and azimuth are uniform (Archimedes).
Eigen::Vector3d uniformDirection(std::mt19937& random) {
  const double height = 2.0 * uniform(random) - 1.0;
  const double azimuth = 2.0 * kPi * uniform(random);
  const double radius = std::sqrt(std::max(0.0, 1.0 - height * height));
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), height};
}

void append(std::vector<Perturbation>& all, const SweepPlan& plan, int scan_index, PerturbationKind kind,
            double magnitude) {
  if (!(magnitude >= 0.0) || !std::isfinite(magnitude)) {
    throw std::invalid_argument("sweep: got magnitude " + std::to_string(magnitude) +
                                ", wanted a number from 0");
  }
  const auto micros = static_cast<std::uint64_t>(std::llround(magnitude * 1e6));
  std::seed_seq seed{static_cast<std::uint32_t>(plan.seed), static_cast<std::uint32_t>(scan_index),
                     static_cast<std::uint32_t>(kind), static_cast<std::uint32_t>(micros),
                     static_cast<std::uint32_t>(micros >> 32)};
  std::mt19937 random(seed);
  for (int direction = 0; direction < plan.directions; ++direction) {
    const Eigen::Vector3d step = magnitude * uniformDirection(random);
    Perturbation perturbation{kind, magnitude, direction, Eigen::Isometry3d::Identity()};
    if (kind == PerturbationKind::kTranslation) {
      perturbation.T_sensor_prior.translation() = step;
    } else {
      perturbation.T_sensor_prior.linear() = expSo3(step);
    }
    all.push_back(perturbation);
  }
}

}  // namespace

const char* name(PerturbationKind kind) {
  return kind == PerturbationKind::kTranslation ? "translation" : "rotation";
}

PerturbationKind perturbationKindFromName(const std::string& text) {
  if (text == "translation") return PerturbationKind::kTranslation;
  if (text == "rotation") return PerturbationKind::kRotation;
  throw std::invalid_argument("perturbation kind: got '" + text + "', wanted translation or rotation");
}

std::vector<Perturbation> perturbations(const SweepPlan& plan, int scan_index) {
  if (plan.directions < 0) {
    throw std::invalid_argument("sweep: got " + std::to_string(plan.directions) +
                                " directions, wanted 0 or more");
  }
  std::vector<Perturbation> all;
  for (const double magnitude : plan.translations) {
    append(all, plan, scan_index, PerturbationKind::kTranslation, magnitude);
  }
  for (const double magnitude : plan.rotations)
    append(all, plan, scan_index, PerturbationKind::kRotation, magnitude);
  return all;
}

}  // namespace ttsdf
