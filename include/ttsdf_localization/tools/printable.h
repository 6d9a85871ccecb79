#pragma once
// What files and messages say, made fit for a terminal.

#include <string>

namespace ttsdf {

/// Texts of files on a terminal, as one line of UTF-8: line feeds and tabs become blanks, what else the
/// terminal would obey and bytes that are no UTF-8 become '?'.
std::string printable(const std::string& text);

}  // namespace ttsdf
