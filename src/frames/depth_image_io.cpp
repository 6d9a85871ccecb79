// Depth images through VIGRA's impex. What VIGRA does not check itself is checked here: it reads past the end
// of a truncated PGM without an error and crashes on a truncated PGM header.

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <vigra/impex.hxx>
#include <vigra/multi_array.hxx>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

constexpr std::uint16_t kNoReading = 65535;
constexpr long kMaxExtent = 16384;  // [pixel]; a larger header is a damaged or hostile file
constexpr long kMaxPixels = 20000000;

[[noreturn]] void failImage(const std::string& path, const std::string& what) {
  throw std::runtime_error("depth image '" + path + "': " + what);
}

/// VIGRA's messages are several lines with a source position; the line that says what happened is enough.
std::string reason(const std::string& message) {
  const std::size_t start = message.find("violation!");
  if (start == std::string::npos) return message;
  const std::size_t begin = message.find_first_not_of("\n ", start + std::string("violation!").size());
  if (begin == std::string::npos) return message;
  return message.substr(begin, message.find('\n', begin) - begin);
}

/// Next header number of a PNM file, comments skipped; -1 if there is none.
long headerNumber(std::istream& in) {
  while (in >> std::ws && in.peek() == '#') in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  long number = -1;
  return in >> number ? number : -1;
}

void checkBinaryPgm(const std::string& path, std::istream& in) {
  const long width = headerNumber(in), height = headerNumber(in), max_value = headerNumber(in);
  if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent || width * height > kMaxPixels ||
      max_value < 256 || max_value > 65535) {
    failImage(path, "got a PGM header with " + std::to_string(width) + " x " + std::to_string(height) +
                        " pixels up to " + std::to_string(max_value) + ", wanted up to " +
                        std::to_string(kMaxExtent) + " pixels a side and 16 bits");
  }
  const auto wanted =
      static_cast<std::uintmax_t>(in.tellg()) + 1 + 2 * static_cast<std::uintmax_t>(width * height);
  const std::uintmax_t got = std::filesystem::file_size(path);
  if (got < wanted) {
    failImage(path, "is truncated: got " + std::to_string(got) + " bytes, wanted " + std::to_string(wanted));
  }
}

void checkHeader(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char magic[2] = {};
  if (!in || !std::filesystem::is_regular_file(path)) failImage(path, "cannot be opened");
  if (!in.read(magic, 2)) failImage(path, "is empty");
  if (magic[0] == 'v' || magic[0] == '<') FileBytes("depth image", path);  // a pointer of Git LFS, a web page
  if (magic[0] != 'P') return;  // PNG starts with 0x89 and is checked by libpng
  if (magic[1] != '5')
    failImage(path, std::string("got a P") + magic[1] + " file, wanted binary PGM (P5) or PNG");
  checkBinaryPgm(path, in);
}

vigra::MultiArray<2, vigra::UInt16> readPixels(const std::string& path) {
  const vigra::ImageImportInfo info(path.c_str());
  if (std::string(info.getPixelType()) != "UINT16" || info.numBands() != 1) {
    failImage(path, std::string("got pixels of type ") + info.getPixelType() + " with " +
                        std::to_string(info.numBands()) + " channels, wanted 16-bit grey");
  }
  if (info.width() < 1 || info.height() < 1 || info.width() > kMaxExtent || info.height() > kMaxExtent ||
      long{info.width()} * long{info.height()} > kMaxPixels) {
    failImage(path, "got " + std::to_string(info.width()) + " x " + std::to_string(info.height()) +
                        " pixels, wanted 1 to " + std::to_string(kMaxExtent) + " a side and " +
                        std::to_string(kMaxPixels / 1000000) + " million in all");
  }
  vigra::MultiArray<2, vigra::UInt16> pixels(info.shape());
  vigra::importImage(info, pixels);
  return pixels;
}

}  // namespace

Eigen::Array2i depthImageSize(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return {0, 0};
  std::ifstream in(path, std::ios::binary);
  unsigned char head[24] = {};
  in.read(reinterpret_cast<char*>(head), sizeof(head));
  if (!in) return {0, 0};
  long width = 0, height = 0;
  if (head[0] == 'P') {
    in.seekg(2);
    width = headerNumber(in), height = headerNumber(in);
  } else if (head[0] == 0x89 && head[1] == 'P') {
    const auto number = [&head](int at) {
      return long{head[at]} << 24 | long{head[at + 1]} << 16 | long{head[at + 2]} << 8 | long{head[at + 3]};
    };
    width = number(16), height = number(20);
  }
  if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent) return {0, 0};
  return {static_cast<int>(width), static_cast<int>(height)};
}

DepthImage readDepthImage(const std::string& path, double units_per_metre) {
  if (!std::isfinite(units_per_metre) || units_per_metre <= 0.0) {
    throw std::invalid_argument("readDepthImage: got " + std::to_string(units_per_metre) +
                                " units per metre, wanted a positive number");
  }
  checkHeader(path);
  vigra::MultiArray<2, vigra::UInt16> pixels;
  try {
    pixels = readPixels(path);
  } catch (const vigra::StdException& error) {
    const std::string words = error.what();
    if (words.rfind("depth image '", 0) == 0) throw;  // our own
    failImage(path, "cannot be read (" + reason(words) + ")");
  }

  DepthImage image;
  image.width = static_cast<int>(pixels.width());
  image.height = static_cast<int>(pixels.height());
  image.depth.reserve(static_cast<std::size_t>(pixels.size()));
  // The product in single precision, as depth_image_proc has it: both give the same bits.
  const auto metres_per_unit = static_cast<float>(1.0 / units_per_metre);
  for (const std::uint16_t raw : pixels) {
    image.depth.push_back(raw == kNoReading ? 0.0F : static_cast<float>(raw) * metres_per_unit);
  }
  return image;
}

}  // namespace ttsdf
