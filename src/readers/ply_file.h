#pragma once
// PLY, all of it: ascii and binary of both byte orders, every type, lists anywhere, elements in any order.

#include <functional>
#include <string>
#include <vector>

#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of a property; -1 if there is none of that name.
  int find(const std::string& property) const;
};

bool isWhole(PlyType type);

/// One item of an element: a value per scalar property, and the values of its lists.
struct PlyItem {
  std::vector<double> scalars;             ///< by property; the length where it is a list
  std::vector<std::vector<double>> lists;  ///< by property; empty where it is none
};

class PlyFile {
 public:
  /// Reads the header. Throws std::runtime_error naming the file.
  explicit PlyFile(const FileBytes& file);

  const std::vector<PlyElement>& elements() const { return elements_; }
  const PlyElement* find(const std::string& element) const;
  /// Hands over every item of every element, in the order of the file. Throws std::runtime_error: an end
  /// before the counts of the header are reached, more after it, words that are no numbers.
  void read(const std::function<void(const PlyElement&, const PlyItem&)>& visit) const;

 private:
  enum class Format { kAscii, kLittle, kBig };

  void parseHeader();
  void parseProperty(WordCursor& words, std::string_view line);
  /// Counts against the size of the file, before anything is read.
  void checkCounts() const;
  [[noreturn]] void fail(const std::string& message) const { file_.fail(message); }

  const FileBytes& file_;
  Format format_ = Format::kAscii;
  std::vector<PlyElement> elements_;
  const char* data_ = nullptr;
};

}  // namespace ttsdf
