#pragma once
// What all exports do with their files.

#include <initializer_list>
#include <string>

namespace ttsdf {

/// ".ply" of "a/b.PLY"; empty without one.
std::string endingOf(const std::string& path);
/// Throws std::invalid_argument naming what, path and the endings wanted. Returns the path's.
std::string requireEnding(const char* what, const std::string& path,
                          std::initializer_list<const char*> wanted);
/// Whole or not at all; an old file stays until then. Throws std::runtime_error naming the path.
void writeExport(const std::string& path, const std::string& bytes);

}  // namespace ttsdf
