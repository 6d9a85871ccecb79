// The furniture of SceneBuilder: every piece is a few boxes, posts and balls that overlap where they join.
#include <cmath>

#include "ttsdf_localization/simulation/scene_builder.h"

namespace ttsdf {

namespace {

constexpr double kBoard = 0.03;  ///< thickness of boards and panels [m]

Place shifted(const Place& place, double forward, double left, double up) {
  const double c = std::cos(place.yaw), s = std::sin(place.yaw);
  return {place.x + c * forward - s * left, place.y + s * forward + c * left, place.z + up, place.yaw};
}

}  // namespace

void SceneBuilder::table(const Place& place, const Eigen::Vector3d& size) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), leg = 0.06;
  part(place, {-x, -y, size.z() - 0.04}, {x, y, size.z()});
  for (const double side_x : {-x + 0.04, x - 0.04 - leg}) {
    for (const double side_y : {-y + 0.04, y - 0.04 - leg}) {
      part(place, {side_x, side_y, -kEmbed}, {side_x + leg, side_y + leg, size.z() - 0.01});
    }
  }
}

void SceneBuilder::chair(const Place& place) {
  constexpr double kSeat = 0.45, kHalf = 0.21, kLeg = 0.04;
  part(place, {-kHalf, -kHalf, kSeat - 0.04}, {kHalf, kHalf, kSeat});
  part(place, {-kHalf, -kHalf, kSeat - 0.02}, {-kHalf + 0.04, kHalf, 0.92});
  for (const double x : {-kHalf, kHalf - kLeg}) {
    for (const double y : {-kHalf, kHalf - kLeg}) {
      part(place, {x, y, -kEmbed}, {x + kLeg, y + kLeg, kSeat - 0.01});
    }
  }
}

void SceneBuilder::sofa(const Place& place, double width) {
  const double y = 0.5 * width;
  part(place, {-0.45, -y, -kEmbed}, {0.45, y, 0.42});
  part(place, {-0.45, -y, 0.30}, {-0.20, y, 0.85});
  part(place, {-0.44, -y - 0.02, -kEmbed}, {0.46, -y + 0.18, 0.62});
  part(place, {-0.44, y - 0.18, -kEmbed}, {0.46, y + 0.02, 0.62});
}

void SceneBuilder::bed(const Place& place, double width) {
  const double y = 0.5 * width;
  part(place, {-1.0, -y, -kEmbed}, {1.0, y, 0.30});
  part(place, {-0.97, -y + 0.03, 0.25}, {0.97, y - 0.03, 0.50});
  part(place, {-1.05, -y - 0.02, -kEmbed}, {-0.98, y + 0.02, 1.05});
  part(place, {-0.90, -y + 0.12, 0.45}, {-0.50, -0.08, 0.60});
  part(place, {-0.90, 0.08, 0.45}, {-0.50, y - 0.12, 0.60});
}

void SceneBuilder::shelf(const Place& place, const Eigen::Vector3d& size, int boards, int variant) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z();
  part(place, {-x, -y, -kEmbed}, {x, -y + kBoard, h});
  part(place, {-x, y - kBoard, -kEmbed}, {x, y, h});
  part(place, {-x, -y + 0.01, -kEmbed}, {-x + 0.02, y - 0.01, h});
  const double gap = (h - kBoard) / boards;
  for (int i = 0; i <= boards; ++i) {
    const double z = gap * i;
    part(place, {-x + 0.01, -y + 0.01, i == 0 ? -kEmbed : z}, {x - 0.005, y - 0.01, z + kBoard});
    if (i == boards) break;
    // A row of things that fills a varying share of the board from one of its ends.
    const int pattern = (variant * 7 + i * 5) % 11;
    const double row = (0.25 + 0.06 * pattern) * (size.y() - 2.0 * kBoard);
    const double height = (0.45 + 0.04 * ((pattern * 3) % 11)) * gap;
    const double from = pattern % 2 == 0 ? -y + kBoard - 0.005 : y - kBoard + 0.005 - row;
    part(place, {-x + 0.015, from, z + 0.01}, {x - 0.03 - 0.008 * pattern, from + row, z + kBoard + height});
  }
}

void SceneBuilder::cabinet(const Place& place, const Eigen::Vector3d& size, int doors) {
  const double x = 0.5 * size.x(), y = 0.5 * size.y(), h = size.z();
  part(place, {-x, -y, -kEmbed}, {x - 0.02, y, h});
  const double width = size.y() / doors;
  for (int i = 0; i < doors; ++i) {
    const double from = -y + width * i;
    part(place, {x - 0.04, from + 0.01, 0.06}, {x, from + width - 0.01, h - 0.03});
    const double handle = i % 2 == 0 ? from + width - 0.07 : from + 0.04;
    part(place, {x - 0.01, handle, 0.45 * h}, {x + 0.03, handle + 0.03, 0.45 * h + 0.14});
  }
}

void SceneBuilder::lamp(const Place& place, double height) {
  post(shifted(place, 0.0, 0.0, -kEmbed), 0.14, kEmbed + 0.03);
  post(place, 0.02, height - 0.1);
  sphere({place.x, place.y, place.z + height - 0.15}, 0.15);
}

void SceneBuilder::plant(const Place& place, double height) {
  post(shifted(place, 0.0, 0.0, -kEmbed), 0.17, kEmbed + 0.32);
  post(place, 0.03, 0.6 * height);
  sphere({place.x, place.y, place.z + height - 0.25}, 0.25);
  sphere({place.x + 0.12, place.y - 0.08, place.z + 0.7 * height}, 0.18);
}

void SceneBuilder::panel(const Place& place, double width, double height) {
  part(place, {-kEmbed, -0.5 * width, 0.0}, {kBoard, 0.5 * width, height});
}

void SceneBuilder::radiator(const Place& place, double width) {
  for (int i = 0; i * 0.12 < width; ++i) {
    const double from = -0.5 * width + 0.12 * i;
    part(place, {-kEmbed, from, 0.12}, {0.09, from + 0.08, 0.72});
  }
  part(place, {-kEmbed, -0.5 * width, 0.2}, {0.05, 0.5 * width, 0.64});
}

void SceneBuilder::stairs(const Place& place, double width, double run, double rise, int steps) {
  for (int i = 0; i < steps; ++i) {
    part(place, {run * i, -0.5 * width, -kEmbed}, {run * steps, 0.5 * width, rise * (i + 1)});
  }
}

}  // namespace ttsdf
