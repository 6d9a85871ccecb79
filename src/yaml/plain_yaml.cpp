#include "ttsdf_localization/yaml/plain_yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

constexpr int kDeepest = 16;

/// Goes through a document without building anything of it; yaml-cpp descends by recursion, and this ends it
/// early.
class Guard : public YAML::EventHandler {
 public:
  explicit Guard(std::string file) : file_(std::move(file)) {}
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    throw std::runtime_error(file_ + "got an alias in line " + std::to_string(mark.line + 1) +
                             ", wanted plain values");
  }
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    deeper(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    deeper(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void deeper(const YAML::Mark& mark) {
    if (++depth_ > kDeepest) {
      throw std::runtime_error(file_ + "is nested deeper than " + std::to_string(kDeepest) +
                               " levels in line " + std::to_string(mark.line + 1));
    }
  }

  std::string file_;
  int depth_ = 0;
};

}  // namespace

YAML::Node loadPlainYaml(const std::string& what, const std::string& path, std::size_t max_bytes) {
  const std::string name = what + " '" + path + "': ";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw std::runtime_error(name + "no such file");
  const auto size = std::filesystem::file_size(path, error);
  if (error) throw std::runtime_error(name + error.message());
  if (size > max_bytes) {
    throw std::runtime_error(name + "got " + std::to_string(size) + " bytes, wanted at most " +
                             std::to_string(max_bytes));
  }
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw std::runtime_error(name + "cannot be read");
  try {
    YAML::Parser parser(text);
    Guard guard(name);
    if (!parser.HandleNextDocument(guard)) return {};
    return YAML::Load(text.str());
  } catch (const YAML::Exception& problem) {
    throw std::runtime_error(name + problem.what());
  }
}

}  // namespace ttsdf
