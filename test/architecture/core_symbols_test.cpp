// The robot's library reads maps; it has no symbol of what makes and writes them.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

/// Names of the functions that a library defines itself, demangled, without arguments.
std::vector<std::string> functionsOf(const std::string& library) {
  const std::string command = std::string(TTSDF_NM) + " -DC --defined-only '" + library + "'";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string text;
  std::array<char, 4096> part{};
  while (pipe && std::fgets(part.data(), part.size(), pipe.get())) text += part.data();
  std::vector<std::string> names;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    static const std::regex kOwn(R"(^[0-9a-f]+ [TtWwVvBbDdRri] (ttsdf::[^(<]*))");
    if (std::regex_search(line, match, kOwn)) names.push_back(match[1]);
  }
  return names;
}

const std::regex& writing() {
  static const std::regex kWriting(
      "ttsdf::(.*::)?(write[A-Z]|serialize|encode|compress[A-Z]|save[A-Z]|quantize[A-Z]|CoreQuantizer|"
      "ByteWriter|"
      "BitPacker|ttSvd|round|fit[A-Z]|SparseFit|gram|compactMap|principalGauge|orthonormalGauge)");
  return kWriting;
}

std::vector<std::string> writersIn(const std::string& library) {
  std::vector<std::string> found;
  for (const std::string& name : functionsOf(library)) {
    if (name.rfind("ttsdf::writeFileAtomically", 0) == 0) continue;  // bytes, whatever they are
    if (std::regex_search(name, writing())) found.push_back(name);
  }
  return found;
}

TEST(CoreLibrary, HasNoSymbolOfTheWriter) {
  EXPECT_GT(functionsOf(TTSDF_CORE_LIBRARY).size(), 100u);
  for (const std::string& name : writersIn(TTSDF_CORE_LIBRARY)) ADD_FAILURE() << name;
}

TEST(CoreLibrary, TheWriterIsInTheBuildersLibrary) {
  EXPECT_GT(writersIn(TTSDF_COMPRESSION_LIBRARY).size(), 10u);
}

}  // namespace
