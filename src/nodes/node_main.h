#pragma once
// What the mains of the nodes share: --help, which works without a master, and the life of a node that is one
// object.

#include <ros/ros.h>

#include <cstring>
#include <exception>
#include <iostream>

namespace ttsdf {

/// What a node says about itself; names of topics and services as in doc/interface.md.
struct NodeHelp {
  const char* name;
  const char* arguments;  ///< before the usual name:=value
  const char* text;
  const char* launch;  ///< file that starts it, with arguments; empty: none does
};

/// True if an argument asks for the help, which is printed then.
inline bool printedHelp(int argc, char** argv, const NodeHelp& help) {
  for (int n = 1; n < argc; ++n) {
    if (std::strcmp(argv[n], "--help") != 0 && std::strcmp(argv[n], "-h") != 0) continue;
    std::cout << "usage: " << help.name << ' ' << help.arguments << "[NAME:=VALUE]...\n\n"
              << help.text << "\nNAME:=VALUE remaps a topic or service; _NAME:=VALUE sets a parameter.\n"
              << "Topics, services and messages: doc/interface.md; parameters: doc/parameters.md.\n";
    if (*help.launch != '\0')
      std::cout << "Usually started by: roslaunch ttsdf_localization " << help.launch << '\n';
    return true;
  }
  return false;
}

/// A node called `name` unless it is remapped: spins while what `make` returns is there. Takes the remappings
/// out of the arguments before that. Exit code 1 if it does not start.
template <class Make>
int runNode(int& argc, char** argv, const char* name, const NodeHelp& help, const Make& make) {
  if (printedHelp(argc, argv, help)) return 0;
  ros::init(argc, argv, name);
  const ros::NodeHandle node, private_node("~");  // outlive the try: with the last handle the log goes too
  try {
    const auto running = make(node, private_node);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM("does not start: " << error.what());
    return 1;
  }
  return 0;
}

}  // namespace ttsdf
