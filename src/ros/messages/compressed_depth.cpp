// What compressed_depth_image_transport sends: 12 bytes of header, then a PNG of 16 bits or an RVL stream. Of
// 32FC1 images the inverse depth is sent: depth = a / (value - b).

#include <png.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/endian/conversion.hpp>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ros/messages/depth_conversion.h"

namespace ttsdf {

namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::uint32_t kMaxExtent = 16384;  // [pixel]

[[noreturn]] void damaged(const std::string& what) {
  throw std::invalid_argument("compressedDepth image: " + what);
}

struct Pixels {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint16_t> values;
};

void checkExtent(std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0 || width > kMaxExtent || height > kMaxExtent) {
    damaged("got " + std::to_string(width) + " x " + std::to_string(height) + " pixels, wanted 1 to " +
            std::to_string(kMaxExtent) + " a side");
  }
}

struct Source {
  const std::uint8_t* bytes;
  std::size_t left;
};

// libpng is C: an error leaves by longjmp, so nothing with a destructor lives in the function that calls it.
void onError(png_structp png, png_const_charp message) {
  std::strncpy(static_cast<char*>(png_get_error_ptr(png)), message, 99);
  png_longjmp(png, 1);
}
void onWarning(png_structp, png_const_charp) {}
void readFrom(png_structp png, png_bytep out, png_size_t size) {
  auto* const source = static_cast<Source*>(png_get_io_ptr(png));
  if (size > source->left) png_error(png, "is cut off");
  std::memcpy(out, source->bytes, size);
  source->bytes += size;
  source->left -= size;
}

struct Png {
  char error[100] = {};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, error, onError, onWarning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  Png() = default;
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;
  ~Png() { png_destroy_read_struct(&png, &info, nullptr); }
};

bool readHeader(Png& png, Source& source) {
  if (setjmp(png_jmpbuf(png.png))) return false;
  png_set_read_fn(png.png, &source, readFrom);
  png_set_user_limits(png.png, kMaxExtent, kMaxExtent);
  png_read_info(png.png, png.info);
  return true;
}

bool readRows(Png& png, std::uint16_t* values, std::uint32_t width, std::uint32_t height) {
  if (setjmp(png_jmpbuf(png.png))) return false;
  for (std::uint32_t v = 0; v < height; ++v)
    png_read_row(png.png, reinterpret_cast<png_bytep>(values + std::size_t{v} * width), nullptr);
  return true;
}

Pixels decodePng(const std::uint8_t* bytes, std::size_t size) {
  Png png;
  if (!png.info) throw std::bad_alloc();
  Source source{bytes, size};
  if (!readHeader(png, source)) damaged(std::string("PNG: ") + png.error);
  Pixels pixels;
  pixels.width = png_get_image_width(png.png, png.info);
  pixels.height = png_get_image_height(png.png, png.info);
  checkExtent(pixels.width, pixels.height);
  if (png_get_bit_depth(png.png, png.info) != 16 || png_get_channels(png.png, png.info) != 1 ||
      png_get_interlace_type(png.png, png.info) != PNG_INTERLACE_NONE) {
    damaged("PNG: got " + std::to_string(png_get_bit_depth(png.png, png.info)) + " bits and " +
            std::to_string(png_get_channels(png.png, png.info)) + " channels, wanted 16 bits of grey");
  }
  // A row of the image takes at least a few bytes however well it is compressed.
  if (pixels.height > size)
    damaged("PNG: got " + std::to_string(size) + " bytes for " + std::to_string(pixels.height) + " rows");
  pixels.values.resize(std::size_t{pixels.width} * pixels.height);
  if (!readRows(png, pixels.values.data(), pixels.width, pixels.height))
    damaged(std::string("PNG: ") + png.error);
  for (std::uint16_t& value : pixels.values) value = boost::endian::big_to_native(value);
  return pixels;
}

/// Runs of zeros and of differences in groups of three bits (Wilson 2017).
class RvlReader {
 public:
  RvlReader(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), words_(size / 4) {}
  std::uint32_t number() {
    std::uint32_t value = 0;
    for (unsigned shift = 0; shift < 33; shift += 3) {
      const std::uint32_t group = nibble();
      value |= (group & 7U) << shift;
      if (!(group & 8U)) return value;
    }
    damaged("RVL: got a number that does not end");
  }

 private:
  std::uint32_t nibble() {
    if (left_ == 0) {
      if (next_ == words_) damaged("RVL: is cut off");
      std::memcpy(&word_, bytes_ + 4 * next_++, 4);
      word_ = boost::endian::little_to_native(word_);
      left_ = 8;
    }
    const std::uint32_t top = word_ >> 28;
    word_ <<= 4;
    --left_;
    return top;
  }
  const std::uint8_t* bytes_;
  std::size_t words_, next_ = 0;
  std::uint32_t word_ = 0;
  int left_ = 0;
};

Pixels decodeRvl(const std::uint8_t* bytes, std::size_t size) {
  if (size < 8) damaged("RVL: is cut off");
  Pixels pixels;
  std::memcpy(&pixels.width, bytes, 4);
  std::memcpy(&pixels.height, bytes + 4, 4);
  boost::endian::little_to_native_inplace(pixels.width);
  boost::endian::little_to_native_inplace(pixels.height);
  checkExtent(pixels.width, pixels.height);
  RvlReader in(bytes + 8, size - 8);
  const std::size_t count = std::size_t{pixels.width} * pixels.height;
  std::uint32_t previous = 0;  // modulo 2^32: differences of a damaged image add up to anything
  while (pixels.values.size() < count) {
    const std::size_t zeros = in.number(), readings = in.number();
    if (zeros + readings == 0 || zeros + readings > count - pixels.values.size())
      damaged("RVL: got a run that leads out of the image");
    pixels.values.resize(pixels.values.size() + zeros, 0);
    for (std::size_t n = 0; n < readings; ++n) {
      const std::uint32_t zigzag = in.number();
      previous += (zigzag >> 1) ^ (0U - (zigzag & 1U));
      pixels.values.push_back(static_cast<std::uint16_t>(previous));
    }
  }
  return pixels;
}

float littleFloat(const std::uint8_t* bytes) {
  std::uint32_t word;
  std::memcpy(&word, bytes, 4);
  boost::endian::little_to_native_inplace(word);
  float value;
  std::memcpy(&value, &word, 4);
  return value;
}

}  // namespace

sensor_msgs::Image decompressDepth(const sensor_msgs::CompressedImage& message) {
  if (message.format.find("compressedDepth") == std::string::npos)
    damaged("got the format '" + message.format +
            "', wanted '16UC1; compressedDepth' or '32FC1; compressedDepth'");
  if (message.data.size() <= kHeaderBytes) damaged("is cut off");
  const std::uint8_t* const body = message.data.data() + kHeaderBytes;
  const std::size_t size = message.data.size() - kHeaderBytes;
  const bool rvl = message.format.find("rvl") != std::string::npos;
  const Pixels pixels = rvl ? decodeRvl(body, size) : decodePng(body, size);
  sensor_msgs::Image image;
  image.header = message.header;
  image.width = pixels.width;
  image.height = pixels.height;
  image.encoding = message.format.substr(0, message.format.find(';'));
  image.is_bigendian = boost::endian::order::native == boost::endian::order::big;
  if (image.encoding == sensor_msgs::image_encodings::TYPE_32FC1) {
    const float a = littleFloat(message.data.data() + 4), b = littleFloat(message.data.data() + 8);
    image.step = 4 * image.width;
    image.data.resize(std::size_t{image.step} * image.height);
    for (std::size_t n = 0; n < pixels.values.size(); ++n) {
      const std::uint16_t value = pixels.values[n];
      const float depth =
          value ? a / (static_cast<float>(value) - b) : std::numeric_limits<float>::quiet_NaN();
      std::memcpy(image.data.data() + 4 * n, &depth, 4);
    }
  } else {
    image.step = 2 * image.width;
    image.data.resize(std::size_t{image.step} * image.height);
    std::memcpy(image.data.data(), pixels.values.data(), image.data.size());
  }
  return image;
}

}  // namespace ttsdf
