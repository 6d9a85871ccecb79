// Bytes that are no map: always MapFormatError, never a crash, a large allocation or a silently wrong map.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "file_surgery.h"
#include "room_map.h"
#include "ttsdf_localization/compression/map_writer.h"

namespace ttsdf {
namespace {

using test::Bytes;
using test::getNumber;
using test::RawFile;
using test::setNumber;

const std::vector<Encoding> kEncodings = {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized};

Bytes roomBytes(Encoding encoding = Encoding::kQuantized) {
  return serialize(test::roomMap(), test::encodeAs(encoding, 0.005));
}

/// Address space for this test from now on: what a reader allocates on the word of a damaged file fails with
/// bad_alloc, which is no MapFormatError.
class MemoryLimit {
 public:
  explicit MemoryLimit(std::size_t more_bytes) {
    getrlimit(RLIMIT_AS, &before_);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit = before_;
    limit.rlim_cur = pages * 4096 + more_bytes;
    setrlimit(RLIMIT_AS, &limit);
  }
  ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }

 private:
  rlimit before_{};
};

void expectRefused(const Bytes& bytes, const std::string& why) {
  try {
    deserialize(bytes.data(), bytes.size());
    ADD_FAILURE() << why << ": accepted";
  } catch (const MapFormatError& error) {
    EXPECT_NE(std::string(error.what()).find("wanted"), std::string::npos) << why << ": " << error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << why << ": " << error.what();
  }
}

/// A damaged payload under valid checksums: refused, or a map that keeps its invariants.
void expectRefusedOrSound(const Bytes& bytes, const std::string& why) {
  try {
    check(deserialize(bytes.data(), bytes.size()));
  } catch (const MapFormatError&) {
  } catch (const std::exception& error) {
    ADD_FAILURE() << why << ": " << error.what();
  }
}

void expectRefusedAfter(const std::string& why, const std::function<void(RawFile&)>& spoil,
                        Encoding encoding = Encoding::kQuantized) {
  RawFile file = test::takeApart(roomBytes(encoding));
  spoil(file);
  const MemoryLimit limit(std::size_t{500} << 20);
  expectRefused(test::putTogether(file), why);
}

template <typename T>
void expectRefusedWith(const std::string& why, const std::string& section, std::size_t at, T value,
                       Encoding encoding = Encoding::kQuantized) {
  expectRefusedAfter(
      why + " = " + std::to_string(value),
      [&](RawFile& file) { setNumber(file.section(section).payload, at, value); }, encoding);
}

TEST(MapFormatError, TheSurgeryItselfIsHarmless) {
  for (const Encoding encoding : kEncodings) {
    const Bytes bytes = roomBytes(encoding);
    EXPECT_EQ(test::putTogether(test::takeApart(bytes)), bytes);
  }
}

TEST(MapFormatError, TruncatedAtEveryLength) {
  for (const Encoding encoding : kEncodings) {
    const Bytes bytes = roomBytes(encoding);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      expectRefused(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)),
                    "first " + std::to_string(size) + " bytes");
    }
  }
}

TEST(MapFormatError, EverySingleBitFlipped) {
  const Bytes bytes = roomBytes();
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    Bytes flipped = bytes;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1u << (bit % 8)));
    expectRefused(flipped, "bit " + std::to_string(bit));
  }
}

TEST(MapFormatError, BytesAppended) {
  Bytes bytes = roomBytes();
  bytes.push_back(0);
  expectRefused(bytes, "one byte more");
}

TEST(MapFormatError, ForeignFiles) {
  expectRefused({}, "nothing");
  expectRefused(Bytes(100, 0), "zeros");
  expectRefused(Bytes(100000, 0xFF), "ones");
  const std::string text = "solid teapot\nfacet normal 0 0 1\n";
  expectRefused(Bytes(text.begin(), text.end()), "a mesh");
  expectRefused({0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R'}, "a picture");
  Bytes text_mode = roomBytes();  // a transfer that "repaired" line ends
  text_mode.erase(text_mode.begin() + 5);
  expectRefused(text_mode, "a map sent as text");
  std::mt19937 random(1);
  for (int n = 0; n < 100; ++n) {
    Bytes noise(random() % 5000);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    expectRefused(noise, "noise");
  }
}

TEST(MapFormatError, UnknownVersionSaysGotAndWanted) {
  RawFile file = test::takeApart(roomBytes());
  file.version = 7;
  const Bytes bytes = test::putTogether(file);
  try {
    deserialize(bytes.data(), bytes.size());
    FAIL() << "accepted";
  } catch (const MapFormatError& error) {
    EXPECT_STREQ(error.what(), "map file: format version: got 7, wanted 1");
  }
}

TEST(MapFormatError, UnknownSectionsAreSkippedUnlessRequired) {
  RawFile file = test::takeApart(roomBytes(Encoding::kFloat32));
  file.sections.insert(file.sections.begin(), {"NEXT", 0, Bytes(77, 5)});
  const Bytes with_optional = test::putTogether(file);
  EXPECT_EQ(deserialize(with_optional.data(), with_optional.size()).train.first(),
            test::roomMap().train.first());
  file.sections.front().flags = 1;
  expectRefused(test::putTogether(file), "a required section from the future");
}

TEST(MapFormatError, MissingAndDoubledSections) {
  for (const std::string id : {"GEOM", "FIEL", "CORE"}) {
    RawFile file = test::takeApart(roomBytes());
    auto& sections = file.sections;
    const auto at = std::find_if(sections.begin(), sections.end(), [&](const auto& s) { return s.id == id; });
    const auto section = *at;
    sections.erase(at);
    expectRefused(test::putTogether(file), "without " + id);
    sections.push_back(section);
    sections.push_back(section);
    expectRefused(test::putTogether(file), "twice " + id);
  }
}

TEST(MapFormatError, HeaderFieldsWithHugeSizes) {
  const Bytes bytes = roomBytes();
  const MemoryLimit limit(std::size_t{256} << 20);
  for (const std::uint32_t count :
       {0u, 1u, getNumber<std::uint32_t>(bytes, 12) + 1u, 64u, 65u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    Bytes changed = bytes;
    setNumber(changed, 12, count);
    expectRefused(changed, "sections " + std::to_string(count));
  }
  for (std::size_t n = 0; n < getNumber<std::uint32_t>(bytes, 12); ++n) {
    for (const std::uint64_t size : {std::uint64_t{0}, std::uint64_t{1} << 32, ~std::uint64_t{0}}) {
      Bytes changed = bytes;
      setNumber(changed, test::kHeaderBytes + test::kEntryBytes * n + 8, size);
      test::sealHeader(changed);
      expectRefused(changed, "section of " + std::to_string(size) + " bytes");
    }
  }
  for (const std::size_t reserved : {std::size_t{28}, test::kHeaderBytes + 20}) {
    Bytes changed = bytes;
    changed[reserved] = 1;
    test::sealHeader(changed);
    expectRefused(changed, "a reserved field");
  }
}

TEST(MapFormatError, GeometryFields) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const std::size_t axis : {0u, 1u, 2u}) {
    for (const std::uint32_t extent : {0u, 1u, 29u, 1u << 20, (1u << 20) + 1, 0x80000000u, 0xFFFFFFFFu}) {
      expectRefusedWith("extent", "GEOM", 4 * axis, extent);
    }
  }
  for (const double size : {0.0, -0.1, 1e-6, 1e3, nan, inf})
    expectRefusedWith("voxel size", "GEOM", 12, size);
  for (std::size_t entry = 0; entry < 12; ++entry) {
    for (const double value : {nan, inf}) expectRefusedWith("transform", "GEOM", 20 + 8 * entry, value);
  }
  expectRefusedWith("a rotation that stretches", "GEOM", 20, 1.7);
  expectRefusedAfter("geometry too short", [](RawFile& file) { file.section("GEOM").payload.pop_back(); });
  expectRefusedAfter("geometry too long", [](RawFile& file) { file.section("GEOM").payload.push_back(0); });
}

TEST(MapFormatError, FieldFields) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectRefusedWith<std::uint8_t>("kind", "FIEL", 0, 2);
  for (const std::size_t at : {1u, 9u, 17u}) {
    for (const double value : {-0.1, nan}) expectRefusedWith("distance", "FIEL", at, value);
  }
  for (const std::uint32_t size : {6u, 8u, 0xFFFFFFFFu}) expectRefusedWith("frame size", "FIEL", 25, size);
  expectRefusedWith<std::uint8_t>("frame text", "FIEL", 29, 0xFF);
}

TEST(MapFormatError, MetadataFields) {
  for (const std::uint32_t size : {0u, 10u, 16u << 20, 0xFFFFFFFFu})
    expectRefusedWith("text size", "META", 0, size);
  for (const std::uint32_t size : {0u, 3u, 0xFFFFFFFFu}) expectRefusedWith("coded size", "META", 4, size);
}

TEST(MapFormatError, MaskFields) {
  for (const std::uint32_t cell : {0u, 1u, 3u, 31u, 0xFFFFFFFFu}) expectRefusedWith("cell", "MASK", 0, cell);
  for (std::size_t bucket = 0; bucket < 16; ++bucket) {
    expectRefusedAfter("one cell more in a bucket",
                       [&](RawFile& file) { ++file.section("MASK").payload[4 + 4 * bucket]; });
    for (const std::uint32_t size : {0x7FFFFFFFu, 0xFFFFFFFFu}) {
      expectRefusedWith("bucket", "MASK", 4 + 4 * bucket, size);
    }
  }
  expectRefusedWith<std::uint32_t>("coded size", "MASK", 68, 0xFFFFFFFFu);
}

TEST(MapFormatError, CoreFields) {
  for (const Encoding encoding : kEncodings) {
    expectRefusedWith<std::uint8_t>("encoding", "CORE", 0, 4, encoding);
    for (const std::size_t axis : {1u, 2u, 3u}) {
      for (const std::uint8_t value : {std::uint8_t{3}, std::uint8_t{255}})
        expectRefusedWith("axis", "CORE", axis, value, encoding);
    }
    expectRefusedAfter(
        "the same axis twice",
        [](RawFile& file) {
          auto& core = file.section("CORE").payload;
          core[1] = core[2];
        },
        encoding);
    for (const std::size_t at : {4u, 8u}) {
      for (const std::uint32_t rank : {0u, 1u, 9u, 1000u, 1u << 24, 0x80000000u, 0xFFFFFFFFu}) {
        expectRefusedWith("rank", "CORE", at, rank, encoding);
      }
    }
    expectRefusedAfter(
        "cores too short", [](RawFile& file) { file.section("CORE").payload.pop_back(); }, encoding);
    expectRefusedAfter(
        "cores too long", [](RawFile& file) { file.section("CORE").payload.push_back(0); }, encoding);
  }
}

TEST(MapFormatError, EncodingsAreNotTakenForEachOther) {
  for (const Encoding written : kEncodings) {
    for (const Encoding claimed : kEncodings) {
      if (written == claimed) continue;
      expectRefusedWith("encoding", "CORE", 0, static_cast<std::uint8_t>(claimed), written);
    }
  }
}

TEST(MapFormatError, NumbersThatAreNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expectRefusedWith("core entry", "CORE", 12 + 4 * 17, nan, Encoding::kFloat32);
  expectRefusedWith<std::uint16_t>("core entry", "CORE", 12 + 2 * 17, 0x7E00, Encoding::kFloat16);
  for (const float step : {nan, 0.0f, -0.1f, std::numeric_limits<float>::infinity(), 3e38f}) {
    expectRefusedWith("step", "CORE", 12, step);
  }
}

TEST(MapFormatError, HugeGridsCostNothing) {
  // Consistent with themselves as far as their sizes go: 2^60 voxels, ranks that would need 300 GB.
  RawFile file = test::takeApart(roomBytes());
  for (std::size_t axis = 0; axis < 3; ++axis) setNumber(file.section("GEOM").payload, 4 * axis, 1u << 20);
  setNumber(file.section("CORE").payload, 4, 300u);
  setNumber(file.section("CORE").payload, 8, 300u);
  for (const char* without : {"nothing", "MASK"}) {
    RawFile changed = file;
    auto& sections = changed.sections;
    sections.erase(
        std::remove_if(sections.begin(), sections.end(), [&](const auto& s) { return s.id == without; }),
        sections.end());
    const MemoryLimit limit(std::size_t{64} << 20);
    expectRefused(test::putTogether(changed), std::string("huge, without ") + without);
  }
}

TEST(MapFormatError, RandomDamageUnderValidChecksums) {
  std::mt19937 random(2);
  const MemoryLimit limit(std::size_t{500} << 20);
  for (const Encoding encoding : kEncodings) {
    const RawFile whole = test::takeApart(roomBytes(encoding));
    for (int n = 0; n < 1500; ++n) {
      RawFile file = whole;
      Bytes& payload = file.sections[random() % file.sections.size()].payload;
      for (int changes = 1 + static_cast<int>(random() % 4); changes > 0; --changes) {
        payload[random() % payload.size()] = static_cast<std::uint8_t>(random());
      }
      if (random() % 8 == 0) payload.resize(random() % payload.size());
      expectRefusedOrSound(test::putTogether(file), "case " + std::to_string(n));
    }
  }
}

}  // namespace
}  // namespace ttsdf
