#include "ttsdf_localization/tools/printable.h"

#include <algorithm>

#include "../../map/format/utf8.h"

namespace ttsdf {

namespace {

/// Bytes of the UTF-8 character that begins at `at`; 0 where none does.
std::size_t characterSize(const std::string& text, std::size_t at) {
  for (std::size_t size = 1; size <= 4 && at + size <= text.size(); ++size) {
    if (isUtf8(text.substr(at, size))) return size;
  }
  return 0;
}

/// Terminals do something else than show it: C0 (but not the tab), DEL, C1, line ends and directions of
/// Unicode.
bool isObeyed(const std::string& character) {
  if (character.size() == 1) {
    const auto c = static_cast<unsigned char>(character[0]);
    return (c < ' ' && c != '\t') || c == 0x7F;
  }
  if (character.size() == 2) return character[0] == '\xC2' && static_cast<unsigned char>(character[1]) < 0xA0;
  const bool lines_and_directions = character >= "\xE2\x80\xA8" && character <= "\xE2\x80\xAE";
  const bool isolates = character >= "\xE2\x81\xA6" && character <= "\xE2\x81\xA9";
  return character.size() == 3 && (lines_and_directions || isolates);
}

}  // namespace

std::string printable(const std::string& text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = characterSize(text, at);
    const std::string character = text.substr(at, std::max<std::size_t>(size, 1));
    if (character == "\n" || character == "\t") {
      result += ' ';
    } else {
      result += size == 0 || isObeyed(character) ? "?" : character;
    }
    at += character.size();
  }
  return result;
}

}  // namespace ttsdf
