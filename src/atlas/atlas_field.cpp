#include "ttsdf_localization/atlas/atlas_field.h"

#include <algorithm>
#include <set>
#include <utility>

#include "atlas_far_field.h"
#include "atlas_members.h"

namespace ttsdf {

namespace {

/// Of the worst map: a scan may lie in any of them.
FrameAgreement worstOf(const std::vector<PlacedField>& maps) {
  FrameAgreement worst;
  for (const PlacedField& map : maps) {
    const FrameAgreement& one = map.field->agreement();
    worst.compared += one.compared;
    worst.contradicting += one.contradicting;
    worst.without_overlap += one.without_overlap;
    for (double FrameAgreement::*figure :
         {&FrameAgreement::position_median, &FrameAgreement::position_90, &FrameAgreement::rotation_median,
          &FrameAgreement::rotation_90, &FrameAgreement::widening, &FrameAgreement::shift,
          &FrameAgreement::turn_sensor, &FrameAgreement::turn_scene}) {
      worst.*figure = std::max(worst.*figure, one.*figure);
    }
    worst.viewpoint_distance = std::max(worst.viewpoint_distance, one.viewpoint_distance);
    for (ViewpointAgreement v : one.viewpoints) {
      v.viewpoint.position = map.T_atlas_map * v.viewpoint.position;
      v.viewpoint.view = map.T_atlas_map.linear() * v.viewpoint.view;
      worst.viewpoints.push_back(v);
    }
  }
  return worst;
}

/// Points of one piece: which maps hold them, and how deep.
class SupportingMaps {
 public:
  SupportingMaps(const std::vector<AtlasMember>& all, const PointSpan& points, int begin, int size)
      : size_(size) {
    Eigen::AlignedBox3f bounds;
    for (int n = 0; n < size; ++n) {
      points_[n] = {points.x[begin + n], points.y[begin + n], points.z[begin + n]};
      if (points_[n].allFinite()) bounds.extend(points_[n]);
    }
    for (const AtlasMember& member : all) {  // most of many maps are elsewhere
      if (member.bounds.intersects(bounds)) members_.push_back(&member);
    }
    depths_.resize(members_.size() * static_cast<std::size_t>(size));
    for (std::size_t m = 0; m < members_.size(); ++m)
      members_[m]->depthsInside(points, begin, size, depths_.data() + at(m, 0));
  }

  const std::vector<const AtlasMember*>& members() const { return members_; }
  const Eigen::Vector3f& point(int n) const { return points_[n]; }
  /// The map that holds each point deepest; -1: none does.
  void takeDeepest(int* chosen) {
    float deepest[kAtlasPiece];
    for (int n = 0; n < size_; ++n) chosen[n] = -1, deepest[n] = kNone;
    for (std::size_t m = 0; m < members_.size(); ++m) {
      const float* const depths = depths_.data() + at(m, 0);
      const int number = static_cast<int>(m);
      for (int n = 0; n < size_; ++n) {  // written so that NaN is no support
        const bool deeper = depths[n] >= 0.0F && depths[n] > deepest[n];
        deepest[n] = deeper ? depths[n] : deepest[n];
        chosen[n] = deeper ? number : chosen[n];
      }
    }
    for (int n = 0; n < size_; ++n) {
      if (chosen[n] >= 0) depths_[at(static_cast<std::size_t>(chosen[n]), n)] = kNone;
    }
  }
  /// The next one for a point.
  int take(int n) {
    int best = -1;
    float deepest = kNone;
    for (std::size_t m = 0; m < members_.size(); ++m) {
      const float depth = depths_[at(m, n)];
      if (depth >= 0.0F && depth > deepest) deepest = depth, best = static_cast<int>(m);
    }
    if (best >= 0) depths_[at(static_cast<std::size_t>(best), n)] = kNone;
    return best;
  }

 private:
  static constexpr float kNone = -1.0F;
  std::size_t at(std::size_t m, int n) const {
    return m * static_cast<std::size_t>(size_) + static_cast<std::size_t>(n);
  }
  int size_;
  Eigen::Vector3f points_[kAtlasPiece];
  std::vector<const AtlasMember*> members_;
  std::vector<float> depths_;
};

/// Asks map after map until every point has an answer that means something, or no map is left.
void evaluatePiece(const std::vector<AtlasMember>& all, const PointSpan& points, const SampleSpan& samples,
                   int begin, int size) {
  SupportingMaps supporting(all, points, begin, size);
  for (int n = 0; n < size; ++n) setOutside(samples, begin + n);
  int chosen[kAtlasPiece];
  AtlasBatch batch;
  for (std::size_t round = 0; round < supporting.members().size(); ++round) {
    bool asked = false;
    if (round == 0) {
      supporting.takeDeepest(chosen);
    } else {
      for (int n = 0; n < size; ++n)
        chosen[n] = samples.state[begin + n] == PointState::kValid ? -1 : supporting.take(n);
    }
    for (std::size_t m = 0; m < supporting.members().size(); ++m) {
      const AtlasMember& member = *supporting.members()[m];
      batch.size = 0;
      for (int n = 0; n < size; ++n) {
        if (chosen[n] == static_cast<int>(m)) batch.add(member, n, supporting.point(n));
      }
      if (batch.size == 0) continue;
      asked = true;
      batch.evaluate(*member.field);
      for (int k = 0; k < batch.size; ++k) {
        // An unknown place keeps the answer of the deepest map.
        if (batch.state[k] == PointState::kValid ||
            (batch.state[k] == PointState::kUnknown &&
             samples.state[begin + batch.point[k]] == PointState::kOutside)) {
          batch.writeSample(member, k, samples, begin + batch.point[k]);
        }
      }
    }
    if (!asked) return;
  }
}

/// See AtlasField.
void evaluateAbsent(const std::vector<AbsentBox>& absent, const PointSpan& points,
                    const SampleSpan& samples) {
  for (int n = 0; n < points.size; ++n) {
    if (samples.state[n] == PointState::kValid) continue;
    const Eigen::Vector3f p(points.x[n], points.y[n], points.z[n]);
    if (std::none_of(absent.begin(), absent.end(), [&p](const AbsentBox& box) { return box.holds(p); }))
      continue;
    setOutside(samples, n);
    samples.value[n] = AtlasField::kAbsentDistance;
    samples.state[n] = PointState::kValid;
  }
}

}  // namespace

AtlasField::AtlasField(std::vector<PlacedField> maps, const std::vector<OrientedBox>& absent)
    : members_(std::make_shared<const Members>(std::move(maps), absent)) {
  setAgreement(worstOf(members_->maps));
}
AtlasField::~AtlasField() = default;

const GridGeometry& AtlasField::geometry() const { return members_->geometry; }
const std::vector<PlacedField>& AtlasField::maps() const { return members_->maps; }

void AtlasField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  for (int begin = 0; begin < points.size; begin += kAtlasPiece) {
    evaluatePiece(members_->members, points, samples, begin, std::min(kAtlasPiece, points.size - begin));
  }
  if (!members_->absent.empty()) evaluateAbsent(members_->absent, points, samples);
}

std::size_t AtlasField::memoryBytes() const {
  std::set<const DistanceField*> counted;  // copies of one map share a field
  std::size_t bytes = 0;
  for (const PlacedField& map : members_->maps) {
    if (counted.insert(map.field.get()).second) bytes += map.field->memoryBytes();
  }
  return bytes;
}

void AtlasField::warmUp(const KeepGoing& keep_going) const {
  for (const PlacedField& map : members_->maps) map.field->warmUp(keep_going);
}

void AtlasField::prepare(const PointSpan& points) const {
  struct Coordinates {
    std::vector<float> x, y, z;
  };
  std::vector<Coordinates> of_member(members_->members.size());
  for (int n = 0; n < points.size; ++n) {
    const Eigen::Vector3f p(points.x[n], points.y[n], points.z[n]);
    const int deepest = members_->deepest(p);
    if (deepest < 0) continue;
    const auto m = static_cast<std::size_t>(deepest);
    const Eigen::Vector3f q = members_->members[m].T_field_atlas * p;
    of_member[m].x.push_back(q.x()), of_member[m].y.push_back(q.y()), of_member[m].z.push_back(q.z());
  }
  for (std::size_t m = 0; m < of_member.size(); ++m) {
    const Coordinates& some = of_member[m];
    if (some.x.empty()) continue;
    members_->members[m].field->prepare(
        PointSpan{some.x.data(), some.y.data(), some.z.data(), static_cast<int>(some.x.size())});
  }
}

std::shared_ptr<const DistanceField> AtlasField::farField() const {
  const auto& maps = members_->maps;
  if (std::none_of(maps.begin(), maps.end(), [](const PlacedField& map) { return map.far != nullptr; }))
    return nullptr;
  return std::make_shared<Far>(members_);
}

}  // namespace ttsdf
