#pragma once
// Arithmetic with stamps of messages, which may hold any number. ros::Duration ends at 2^31 s: the operators
// of ros::Time throw std::runtime_error beyond, and what other nodes send must end no node.

#include <ros/time.h>

#include <string>

namespace ttsdf {

/// to - from [s], whatever the two are. Never throws.
double secondsBetween(const ros::Time& from, const ros::Time& to);

/// time + seconds [s]; the first or last time that ros::Time can hold where the sum lies beyond. Never
/// throws.
ros::Time addSeconds(const ros::Time& time, double seconds);

/// The time of a double [s], limited in the same way.
ros::Time toTime(double seconds);

/// Why neither tf2 nor anybody else can compare `stamp` with the clock; empty: they can.
std::string stampProblem(const ros::Time& stamp, const ros::Time& now);

}  // namespace ttsdf
