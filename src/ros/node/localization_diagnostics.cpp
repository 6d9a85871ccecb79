#include "ros/node/localization_diagnostics.h"

#include "ros/node/localization_output.h"

namespace ttsdf {

namespace {
using Level = diagnostic_msgs::DiagnosticStatus;
using Status = ttsdf_localization::LocalizationStatus;

}  // namespace

LocalizationDiagnostics::LocalizationDiagnostics(const ros::NodeHandle& node,
                                                 const ros::NodeHandle& private_node, const std::string& name)
    : last_rate_time_(ros::WallTime::now()), updater_(node, private_node, name) {
  updater_.setHardwareID("none");
  updater_.add("localization", [this](Wrapper& out) { localization(out); });
  updater_.add("scans", [this](Wrapper& out) { scans(out); });
  updater_.add("transforms", [this](Wrapper& out) { transforms(out); });
}

void LocalizationDiagnostics::update(const LocalizationPipeline::View& view, const std::string& scan_topic,
                                     double quiet_limit, const std::string& waiting) {
  view_ = view;
  scan_topic_ = scan_topic;
  quiet_limit_ = quiet_limit;
  waiting_ = waiting;
  updater_.force_update();  // by wall time: the clock may stand still or jump
}

void LocalizationDiagnostics::localization(Wrapper& out) const {
  const Status& status = view_.status;
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
  out.add("map", view_.map_summary);
  out.add("inlier ratio", status.inlier_ratio);
  out.add("rms residual [m]", status.rms_residual);
  out.add("share outside the map", status.outside_ratio);
  out.add("share in unknown space", status.unknown_ratio);
  out.add("share behind surfaces", status.behind_ratio);
  out.add("score (0 is perfect)", status.score);
  out.add("confidence", status.confidence);
  out.add("degenerate directions", static_cast<int>(status.degenerate_directions));
  out.add("registration [ms]", status.milliseconds);
  out.add("jump from the prior [m]", status.jump_translation);
  out.add("jump from the prior [rad]", status.jump_rotation);
}

void LocalizationDiagnostics::scans(Wrapper& out) {
  const ScanCounts& scans = view_.scans;
  const ros::WallTime now = ros::WallTime::now();
  const double seconds = (now - last_rate_time_).toSec();
  if (seconds > 0.5) {
    rate_ = static_cast<double>(scans.received - last_received_) / seconds;
    last_received_ = scans.received;
    last_rate_time_ = now;
  }
  const double age = scans.last_arrival.isZero() ? -1.0 : (now - scans.last_arrival).toSec();
  // Without scans a state that was tracking is not for long: the two must not contradict each other.
  const bool missed = view_.status.reason == Status::REASON_NO_SCAN && !view_.paused;
  if (scans.received == 0) {
    out.summary(Level::WARN, "no scan yet on " + scan_topic_);
  } else if (age > quiet_limit_ || (missed && age > 0.5)) {
    out.summaryf(Level::ERROR, "no scan on %s for %.1f s", scan_topic_.c_str(), age);
  } else if (missed) {
    out.summaryf(Level::ERROR, "%.1f scans per second, none that can be used", rate_);
  } else {
    out.summaryf(Level::OK, "%.1f scans per second", rate_);
  }
  out.add("topic", scan_topic_);
  out.add("rate [Hz]", rate_);
  out.add("received", scans.received);
  out.add("unreadable", scans.unreadable);
  out.add("without transforms", scans.untransformed);
  out.add("dropped for a newer one", scans.dropped);
  out.add("skipped", scans.skipped);
  out.add("refused", scans.rejected);
  out.add("latency of the last pose [s]", view_.status.latency);
}

void LocalizationDiagnostics::transforms(Wrapper& out) const {
  const std::uint8_t state = view_.status.state;
  const bool in_use = state == Status::TRACKING || state == Status::DEGRADED;
  if (!waiting_.empty()) {
    out.summary(Level::ERROR, waiting_);
  } else if (!view_.tf_wanted) {
    out.summary(Level::OK, "broadcast is switched off");
  } else if (view_.tf_sent) {
    out.summary(Level::OK, view_.tf_frames + " is sent");
    out.add("age of the last transform [s]", view_.tf_age);
  } else if (in_use) {
    out.summary(Level::WARN, view_.tf_frames +
                                 " is not sent: there was no pose to send since the last one became too old");
  } else {
    out.summary(Level::WARN, view_.tf_frames + " is not sent in state " + view_.status.state_name);
  }
  out.add("transform", view_.tf_frames);
}

void LocalizationDiagnostics::setAtlas(const AtlasLoaderStatus& status) {
  if (!atlas_) updater_.add("atlas", [this](Wrapper& out) { atlas(out); });
  atlas_ = status;
}

void LocalizationDiagnostics::atlas(Wrapper& out) const {
  const auto listed = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
  };
  if (atlas_->behind) {
    out.summary(Level::ERROR, "loading is behind the robot: waiting for " + listed(atlas_->waiting));
  } else if (!atlas_->failed.empty()) {
    const auto& [name, why] = *atlas_->failed.begin();
    out.summary(Level::ERROR, "map '" + name + "': " + why);
  } else if (atlas_->in_use.empty()) {
    out.summary(Level::WARN, "no map is in use");
  } else if (atlas_->over_budget > 0) {
    out.summaryf(Level::WARN, "no memory for %zu maps that are near (atlas_megabytes)", atlas_->over_budget);
  } else {
    out.summaryf(Level::OK, "%zu maps in use", atlas_->in_use.size());
  }
  out.add("in use", listed(atlas_->in_use));
  out.add("waiting", listed(atlas_->waiting));
  out.add("in memory", atlas_->loaded);
  out.add("bytes", atlas_->bytes);
  for (const auto& [name, why] : atlas_->failed) out.add("failed: " + name, why);
}

}  // namespace ttsdf
