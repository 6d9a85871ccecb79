#include "ttsdf_localization/ros/localization_diagnostics.h"

#include "ttsdf_localization/ros/localization_output.h"

namespace ttsdf {

namespace {
using Level = diagnostic_msgs::DiagnosticStatus;
using Status = ttsdf_localization::LocalizationStatus;

double secondsSince(const ros::WallTime& time) {
  return time.isZero() ? -1.0 : (ros::WallTime::now() - time).toSec();
}
}  // namespace

LocalizationDiagnostics::LocalizationDiagnostics(const ros::NodeHandle& node,
                                                 const ros::NodeHandle& private_node, const std::string& name)
    : last_rate_time_(ros::WallTime::now()), updater_(node, private_node, name) {
  updater_.setHardwareID("none");
  updater_.add("localization", [this](Wrapper& out) { localization(out); });
  updater_.add("scans", [this](Wrapper& out) { scans(out); });
  updater_.add("transforms", [this](Wrapper& out) { transforms(out); });
}

void LocalizationDiagnostics::update(const DiagnosticsSnapshot& snapshot) {
  snapshot_ = snapshot;
  updater_.force_update();  // by wall time: the clock may stand still or jump
}

void LocalizationDiagnostics::localization(Wrapper& out) const {
  const Status& status = snapshot_.status;
  switch (status.state) {
    case Status::TRACKING:
      out.summary(Level::OK, "tracking");
      break;
    case Status::LOST:
    case Status::NO_MAP:
    case Status::ERROR:
      out.summary(Level::ERROR, status.state_name + (status.message.empty() ? "" : ": " + status.message));
      break;
    default:
      out.summary(Level::WARN, status.state_name + (status.message.empty() ? "" : ": " + status.message));
  }
  out.add("map", snapshot_.map_summary);
  out.add("inlier ratio", status.inlier_ratio);
  out.add("rms residual [m]", status.rms_residual);
  out.add("share outside the map", status.outside_ratio);
  out.add("share in unknown space", status.unknown_ratio);
  out.add("share behind surfaces", status.behind_ratio);
  out.add("score (0 is perfect)", status.score);
  out.add("directions without information", static_cast<int>(status.weak_directions));
  out.add("registration [ms]", status.milliseconds);
  out.add("jump from the prior [m]", status.jump_translation);
  out.add("jump from the prior [rad]", status.jump_rotation);
}

void LocalizationDiagnostics::scans(Wrapper& out) {
  const CloudCounts& clouds = snapshot_.clouds;
  const ros::WallTime now = ros::WallTime::now();
  const double seconds = (now - last_rate_time_).toSec();
  if (seconds > 0.1) {
    rate_ = static_cast<double>(clouds.received - last_received_) / seconds;
    last_received_ = clouds.received;
    last_rate_time_ = now;
  }
  const double age = secondsSince(clouds.last_arrival);
  if (clouds.received == 0) {
    out.summary(Level::WARN, "no cloud yet on " + snapshot_.cloud_topic);
  } else if (age > snapshot_.quiet_limit) {
    out.summaryf(Level::ERROR, "no cloud on %s for %.0f s", snapshot_.cloud_topic.c_str(), age);
  } else {
    out.summaryf(Level::OK, "%.1f clouds per second", rate_);
  }
  out.add("topic", snapshot_.cloud_topic);
  out.add("rate [Hz]", rate_);
  out.add("received", clouds.received);
  out.add("unreadable", clouds.unreadable);
  out.add("without transforms", clouds.untransformed);
  out.add("dropped for a newer one", snapshot_.status.dropped);
  out.add("refused", snapshot_.status.refused);
  out.add("latency of the last pose [s]", snapshot_.status.latency);
}

void LocalizationDiagnostics::transforms(Wrapper& out) const {
  if (!snapshot_.why_waiting.empty()) {
    out.summary(Level::ERROR, "clouds wait for transforms" + snapshot_.why_waiting);
  } else if (!snapshot_.tf_wanted) {
    out.summary(Level::OK, "broadcast is switched off");
  } else if (!snapshot_.tf_active) {
    out.summary(Level::WARN, snapshot_.tf_frames + " is not sent in state " + snapshot_.status.state_name);
  } else {
    out.summary(Level::OK, snapshot_.tf_frames + " is sent");
    out.add("age of the last transform [s]", snapshot_.tf_age);
  }
  out.add("transform", snapshot_.tf_frames);
}

}  // namespace ttsdf
