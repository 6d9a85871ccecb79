#include "ros/offline/offline_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <sstream>
#include <utility>

#include "ros/messages/conversions.h"

namespace ttsdf {

namespace {

/// Seconds with all nine digits, which a double would not hold.
std::string text(const ros::Time& stamp) {
  std::ostringstream out;
  out << stamp.sec << '.' << std::setw(9) << std::setfill('0') << stamp.nsec;
  return out.str();
}

std::string quoted(const std::string& message) {
  std::string out = "\"";
  for (const char c : message) out += c == '"' ? std::string("\"\"") : std::string(1, c == '\n' ? ' ' : c);
  return out + '"';
}

/// Value below which a share `p` of the values lies.
double percentile(std::vector<double> values, double p) {
  const auto n = static_cast<std::size_t>(p * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), values.end());
  return values[n];
}

void writePose(std::ostream& out, const Eigen::Isometry3d& T, char separator) {
  const Eigen::Quaterniond q(T.linear());
  const Eigen::Vector3d t = T.translation();
  out << std::fixed << std::setprecision(9);
  for (const double x : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z()}) out << x << separator;
  out << q.w();
}

}  // namespace

OfflineReport::OfflineReport(const Paths& paths, bool with_times)
    : trajectory_(paths.trajectory),
      covariances_(paths.covariances),
      statuses_(paths.statuses),
      with_times_(with_times) {
  covariances_.stream() << "stamp";
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) covariances_.stream() << ",c" << row << column;
  }
  covariances_.stream() << '\n';
  statuses_.stream()
      << "stamp,state,reason,pose_valid,points,iterations,rms_residual,inlier_ratio,outside_ratio,"
         "unknown_ratio,behind_ratio,score,jump_translation,jump_rotation,degenerate_directions,tx,ty,tz,qx,"
         "qy,qz,"
         "qw,"
      << (with_times_ ? "ms," : "") << "message\n";
}

void OfflineReport::add(const std_msgs::Header& header, const Status& status,
                        const LocalizationUpdate& update) {
  ++scans_;
  ++states_[status.state_name];
  if (status.state_name == "lost" && last_state_ != "lost") ++times_lost_;
  last_state_ = status.state_name;
  const double stamp = header.stamp.toSec();
  if (!first_stamp_) first_stamp_ = stamp;
  last_stamp_ = stamp;
  if (update.registered) milliseconds_.push_back(status.milliseconds);
  if (status.pose_valid) {
    ++poses_;
    const Eigen::Vector3d position = update.T_map_base.translation();
    if (last_position_) distance_ += (position - *last_position_).norm();
    last_position_ = position;
    trajectory_.stream() << text(header.stamp) << ' ';
    writePose(trajectory_.stream(), update.T_map_base, ' ');
    trajectory_.stream() << '\n';
    covariances_.stream() << text(header.stamp) << std::scientific << std::setprecision(9);
    for (const double number : toCovarianceMessage(update.covariance)) covariances_.stream() << ',' << number;
    covariances_.stream() << '\n';
  } else {
    Complaint& complaint = complaints_[status.reason];
    ++complaint.count;
    if (!status.message.empty()) complaint.message = status.message;
  }
  writeStatus(header, status, update);
}

void OfflineReport::writeStatus(const std_msgs::Header& header, const Status& status,
                                const LocalizationUpdate& update) {
  std::ostream& out = statuses_.stream();
  out << text(header.stamp) << ',' << status.state_name << ',' << static_cast<int>(status.reason) << ','
      << static_cast<int>(status.pose_valid) << ',' << status.points << ',' << status.iterations << ','
      << std::fixed << std::setprecision(6);
  for (const double x : {status.rms_residual, status.inlier_ratio, status.outside_ratio, status.unknown_ratio,
                         status.behind_ratio, status.score, status.jump_translation, status.jump_rotation}) {
    out << x << ',';
  }
  out << static_cast<int>(status.degenerate_directions) << ',';
  if (status.pose_valid) {
    writePose(out, update.T_map_base, ',');
  } else {
    out << ",,,,,,";
  }
  out << ',';
  if (with_times_) out << std::setprecision(3) << status.milliseconds << ',';
  out << quoted(status.message) << '\n';
}

double OfflineReport::medianMilliseconds() const {
  return milliseconds_.empty() ? 0.0 : percentile(milliseconds_, 0.5);
}

std::string OfflineReport::reasonForNoPose() const {
  if (poses_ > 0) return {};
  const auto most =
      std::max_element(complaints_.begin(), complaints_.end(),
                       [](const auto& a, const auto& b) { return a.second.count < b.second.count; });
  if (most == complaints_.end()) return "the bag has no scan";
  std::ostringstream text;
  text << most->second.count << " of " << scans_ << " scans: " << most->second.message;
  return text.str();
}

void OfflineReport::close() {
  trajectory_.close();
  covariances_.close();
  statuses_.close();
}

std::string OfflineReport::summary(double seconds, int global_localizations) const {
  std::ostringstream out;
  const double duration = first_stamp_ ? last_stamp_ - *first_stamp_ : 0.0;
  out << std::fixed << std::setprecision(1);
  out << "scans                  " << scans_ << '\n';
  out << "poses                  " << poses_;
  if (scans_ > 0) out << " (" << 100.0 * poses_ / scans_ << " %)";
  out << '\n';
  for (const auto& [state, count] : states_)
    out << "  " << std::left << std::setw(21) << state << count << '\n';
  out << "times lost             " << times_lost_ << '\n';
  out << "global localizations   " << global_localizations << '\n';
  out << "distance               " << distance_ << " m\n";
  if (!milliseconds_.empty()) {
    out << "registration           median " << std::setprecision(2) << percentile(milliseconds_, 0.5)
        << " ms, 99 % " << percentile(milliseconds_, 0.99) << " ms\n"
        << std::setprecision(1);
  }
  out << "run                    " << duration << " s of the bag in " << seconds << " s";
  if (seconds > 0.0)
    out << ": " << duration / seconds << " times real time, " << scans_ / seconds << " scans per second";
  out << '\n';
  return out.str();
}

}  // namespace ttsdf
