#include "export_ending.h"

#include <algorithm>
#include <stdexcept>

#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

std::string requireEnding(const char* what, const std::string& path,
                          std::initializer_list<const char*> wanted) {
  const std::string ending = lowerEnding(path);
  if (std::find(wanted.begin(), wanted.end(), ending) != wanted.end()) return ending;
  std::string list;
  std::size_t left = wanted.size();
  for (const char* const one : wanted)
    list += std::string(one) + (--left == 0 ? "" : left == 1 ? " or " : ", ");
  throw std::invalid_argument(std::string(what) + " '" + path + "': got ending '" + ending + "', wanted " +
                              list);
}

}  // namespace ttsdf
