#pragma once
// The nodes' --help. Asked before ros::init, so that it works without a master.

#include <cstring>
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

}  // namespace ttsdf
