#pragma once
// Formats are chosen by the ending of a file's name.

#include <initializer_list>
#include <string>

namespace ttsdf {

/// Throws std::invalid_argument naming what, path and the endings wanted. Returns the path's, in lower case.
std::string requireEnding(const char* what, const std::string& path,
                          std::initializer_list<const char*> wanted);

}  // namespace ttsdf
