#include "ttsdf_localization/yaml/plain_yaml.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>
#include <vector>

namespace ttsdf {
namespace {

/// What the text is refused with; empty if it is taken.
std::string refusal(const std::string& text, Aliases aliases = Aliases::kRefused) {
  try {
    plainYaml("file: ", text, aliases);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

// yaml-cpp's own parser is the oracle.
TEST(PlainYaml, ReadsWhatYamlCppReads) {
  const std::vector<std::string> texts = {
      "",
      "# nothing\n",
      "a: 1\nb: [1, 2.5, -3e4]\nc: {d: 'e', f: \"g\\n\"}\n",
      "---\nlist:\n  - name: x\n    pose: [0, 0, 0]\n  - {name: y}\n...\n",
      "text: |\n  two\n  lines\nfolded: >\n  one\n  line\n",
      "nothing: ~\nempty:\nword: null\nquoted: 'null'\n",
      "? complex\n: value\n1: number\ntrue: word\n",
      "[1, [2, [3]], {}, []]\n",
      "windows: 1\r\nline: 2\r\n",
      "base: &b {x: 1}\ncopy: *b\nagain: [*b, *b]\n",
      "a: &x 1\nb: &x 2\nc: *x\n",
      "umlaut: \xc3\xa4\nescaped: \"\\u00e4\"\n",
      "tag: !!str 12\nown: !thing 3\n"};
  for (const std::string& text : texts) {
    const YAML::Node got = plainYaml("file: ", text, Aliases::kAllowed), wanted = YAML::Load(text);
    EXPECT_EQ(YAML::Dump(got), YAML::Dump(wanted)) << text;
    EXPECT_EQ(got.Type(), wanted.Type()) << text;
  }
}

TEST(PlainYaml, KnowsWhatIsQuoted) {
  const YAML::Node node = plainYaml("file: ", "plain: 1\nquoted: '1'\nblock: |\n  1\n");
  EXPECT_EQ(node["plain"].Tag(), "?");
  EXPECT_EQ(node["quoted"].Tag(), "!");
  EXPECT_EQ(node["block"].Tag(), "!");
  EXPECT_EQ(node["quoted"].as<int>(), 1);
}

TEST(PlainYaml, SaysWhereATextIsWrong) {
  EXPECT_EQ(refusal("a: [1, 2\nb: 3\n").rfind("file: line 2, column 2: ", 0), 0U)
      << refusal("a: [1, 2\nb: 3\n");
  EXPECT_EQ(refusal("a: 1\n\tb: 2\n").rfind("file: line 2, column 1: ", 0), 0U) << refusal("a: 1\n\tb: 2\n");
  EXPECT_EQ(refusal("a: 1\n---\nb: 2\n"), "file: line 2, column 1: got a second document, wanted one");
  EXPECT_EQ(refusal("a: 1\nb: 2\na: 3\n"), "file: line 3, column 1: got the key 'a' again, wanted it once");
  EXPECT_EQ(refusal(std::string("a: 1\0b", 6)), "file: got a byte 0, wanted a text");
  EXPECT_EQ(refusal("a: &x 1\nb: *x\n"), "file: line 2, column 4: got an alias, wanted plain values");
  EXPECT_EQ(refusal("a: *x\n", Aliases::kAllowed), "file: line 1, column 4: got an alias of nothing: 'x'");
  EXPECT_EQ(refusal("a: &a [1, *a]\n", Aliases::kAllowed),
            "file: line 1, column 11: got an alias of what holds it");
  EXPECT_EQ(refusal(std::string(16, '[') + std::string(16, ']')), "");
  EXPECT_EQ(refusal(std::string(17, '[') + std::string(17, ']')),
            "file: line 1, column 17: nested deeper than 16 levels");
  EXPECT_NE(refusal(std::string(1000000, '[')), "");
  EXPECT_EQ(refusal("a: 1\nb: M\xfcller\n").rfind("file: line 2, column 5: ", 0), 0U)  // Latin-1
      << refusal("a: 1\nb: M\xfcller\n");
}

// yaml-cpp 0.6 (Debian 11, Ubuntu 20.04) never returns from the first ones.
TEST(PlainYaml, ReturnsFromBrokenTexts) {
  const std::vector<std::string> seeds = {
      "c: {d:] 'e'}\n", "a: [0, 1:]\n", "a: 1[1, 2]\n{c:]|\n {>\n--- d: 'e'}\n",
      "name: a\nmaps:\n  - {file: a.ttsdf, pose: [0, 0, 0]}\n  - {file: b.ttsdf, box: [[0, 1], [2, 3]]}\n"};
  const std::vector<std::string> parts = {"[", "]",    "{",     "}",   ",",   ":",    " ",   "\n",  "- ",
                                          "'", "\"",   "#",     "&x ", "*x",  "? ",   "|\n", ">\n", "!",
                                          "%", "--- ", "...\n", "\t",  "b: ", "\xff", "\\"};
  std::mt19937 random(1);
  const auto begin = std::chrono::steady_clock::now();
  for (int n = 0; n < 20000; ++n) {
    std::string text = seeds[static_cast<std::size_t>(n) % seeds.size()];
    for (unsigned changes = random() % 8; changes > 0; --changes)
      text.insert(random() % (text.size() + 1), parts[random() % parts.size()]);
    refusal(text, Aliases::kAllowed);
  }
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 60.0);
}

}  // namespace
}  // namespace ttsdf
