// doc/map_format.md against the code: a reader written from the page (map_reader.py) must read the files that
// the library writes, refuse what the library refuses, and the page must name every message.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <random>
#include <regex>
#include <sstream>

#include "../map/file_surgery.h"
#include "../map/first_form.h"
#include "../map/room_map.h"
#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

using test::Bytes;
using test::RawFile;
using test::setNumber;

class MapFormatPage : public ::testing::Test {
 protected:
  /// A file, and beside it what a reader must find in it: fields, then samples (index, position, value,
  /// support).
  void writeCase(const std::string& name, const TtSdfMap& written, const EncodeOptions& options) {
    writeCase(name, serialize(written, options));
  }
  void writeCase(const std::string& name, const Bytes& bytes) {
    const TtSdfMap map = deserialize(bytes.data(), bytes.size());
    writeFileAtomically(folder_ / (name + ".ttsdf"), bytes);
    std::ofstream out(folder_ / (name + ".expected"));
    out << std::setprecision(17) << "map_id " << fileInfo(bytes.data(), bytes.size()).map_id << "\nencoding "
        << ttsdf::name(fileInfo(bytes.data(), bytes.size()).encoding) << "\ndims "
        << map.geometry.dims.transpose() << "\nvoxel_size " << map.geometry.voxel_size << "\nranks "
        << map.train.rank1() << ' ' << map.train.rank2() << "\nfield " << ttsdf::name(map.kind)
        << "\ntruncation " << map.truncation << "\nclamp_negative " << map.clamp_negative
        << "\nclamp_positive " << map.clamp_positive << "\nframe_id " << map.frame_id << "\ncell_voxels "
        << map.mask.cellVoxels() << '\n';
    const FrameAgreement& a = map.agreement;
    out << "agreement " << a.compared << ' ' << a.contradicting << ' ' << a.without_overlap << ' '
        << a.position_median << ' ' << a.position_90 << ' ' << a.rotation_median << ' ' << a.rotation_90
        << ' ' << a.widening << ' ' << a.shift << ' ' << a.turn_sensor << ' ' << a.turn_scene << '\n';
    out << "viewpoints";
    if (!a.viewpoints.empty()) out << ' ' << a.viewpoint_distance;
    for (const ViewpointAgreement& v : a.viewpoints) {
      out << ' ' << v.viewpoint.position.transpose() << ' ' << v.viewpoint.view.transpose() << ' ' << v.frames
          << ' ' << v.ratio;
    }
    out << '\n';
    for (const auto& [key, value] : map.metadata) out << "metadata " << key << '=' << value << '\n';
    std::mt19937 random(5);
    for (int n = 0; n < 300; ++n) {
      Eigen::Array3i index;
      for (int axis = 0; axis < 3; ++axis)
        index[axis] = static_cast<int>(random() % static_cast<unsigned>(map.geometry.dims[axis]));
      out << "sample " << index.transpose() << ' '
          << map.geometry.samplePosition(index.cast<double>()).transpose() << ' '
          << map.train(index[0], index[1], index[2]) << ' ' << map.mask.atVoxel(index[0], index[1], index[2])
          << '\n';
    }
  }

  /// Bytes that both readers must refuse, with a message that the page names.
  void writeRefused(const std::string& name, const Bytes& bytes) {
    writeFileAtomically(folder_ / (name + ".refused"), bytes);
    try {
      deserialize(bytes.data(), bytes.size());
      ADD_FAILURE() << name << ": accepted";
    } catch (const MapFormatError& error) {
      const std::string message = error.what(), subject = message.substr(0, message.find(": got "));
      const std::string general =
          std::regex_replace(subject, std::regex("^section [A-Z]{4}"), "section NAME");
      EXPECT_TRUE(pageNames(subject) || pageNames(general))
          << "doc/map_format.md does not name `" << subject << "` (" << message << ")";
    }
  }

  void writeRefused(const std::string& name, const RawFile& file) {
    writeRefused(name, test::putTogether(file));
  }

  void expectReaderAgrees() const {
    const std::string command = std::string(TTSDF_PYTHON) + " -B '" + TTSDF_SOURCE_DIR +
                                "/test/documentation/map_reader_check.py' '" + folder_.path() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
  }

  bool pageNames(const std::string& subject) const {
    return page_.find("`" + subject + "`") != std::string::npos;
  }

  testing::TempFolder folder_;
  const std::string page_ = testing::fileContent(TTSDF_SOURCE_DIR "/doc/map_format.md");
};

TEST_F(MapFormatPage, IsEnoughToReadEveryEncoding) {
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    writeCase(name(encoding), test::roomMap(), test::encodeAs(encoding, 0.005));
  }
  // Small steps make coefficients of several bytes; coarse ones make columns that vanish.
  writeCase("fine", test::roomMap(), test::encodeAs(Encoding::kQuantized, 1e-6));
  writeCase("coarse", test::roomMap(), test::encodeAs(Encoding::kQuantized, 0.1));
  expectReaderAgrees();
}

TEST_F(MapFormatPage, IsEnoughToReadTheFirstForm) {
  writeCase("first_form", test::kFirstForm);
  expectReaderAgrees();
}

TEST_F(MapFormatPage, IsEnoughToReadOddShapes) {
  writeCase("one_voxel", test::roomMap(Dims(1, 1, 1), 1), test::encodeAs(Encoding::kQuantized, 0.01));
  writeCase("flat", test::roomMap(Dims(20, 1, 9), 3), test::encodeAs(Encoding::kQuantized, 0.01));
  // Longer than what is cosine-transformed.
  writeCase("long", test::roomMap(Dims(2100, 4, 5), 4), test::encodeAs(Encoding::kQuantized, 0.01));
  TtSdfMap bare = test::roomMap();
  bare.mask = {};
  bare.metadata.clear();
  bare.agreement = {};
  bare.kind = FieldKind::kTsdf;
  writeCase("bare", bare, {});
  for (const int cell : {1, 2, 30}) {
    TtSdfMap map = test::roomMap();
    map.mask = test::roomMask(map.geometry.dims, cell);
    writeCase("cells_of_" + std::to_string(cell), map, {});
  }
  expectReaderAgrees();
}

TEST_F(MapFormatPage, NamesWhatIsRefusedInTheContainer) {
  const Bytes whole = serialize(test::roomMap());
  const RawFile file = test::takeApart(whole);
  const auto changed = [&](const std::string& name, std::size_t at, std::uint32_t value) {
    Bytes bytes = whole;
    setNumber(bytes, at, value);
    test::sealHeader(bytes);
    writeRefused(name, bytes);
  };
  changed("magic", 0, 0u);
  changed("version", 8, 2u);
  changed("reserved", 28, 1u);
  changed("reserved_of_a_section", test::kHeaderBytes + 20, 1u);
  changed("size_of_a_section", test::kHeaderBytes + 8, 0x7FFFFFFFu);
  changed("checksum_of_a_section", test::kHeaderBytes + 16, 0u);
  Bytes bytes = whole;
  bytes[24] ^= 1u;
  writeRefused("header_checksum", bytes);
  bytes = whole;
  setNumber(bytes, 12, 65u);
  writeRefused("sections", bytes);
  bytes = whole;
  bytes.push_back(0);
  writeRefused("longer", bytes);
  writeRefused("shorter", Bytes(whole.begin(), whole.end() - 1));
  writeRefused("no_header", Bytes(whole.begin(), whole.begin() + 20));

  RawFile next = file;
  next.sections.push_back({"NEXT", 1, Bytes(3, 7)});
  writeRefused("unknown_section", next);
  RawFile twice = file;
  twice.sections.push_back(twice.sections.front());
  writeRefused("twice", twice);
  for (const std::string id : {"GEOM", "FIEL", "CORE"}) {
    RawFile without = file;
    for (std::size_t n = 0; n < without.sections.size(); ++n) {
      if (without.sections[n].id == id)
        without.sections.erase(without.sections.begin() + static_cast<long>(n));
    }
    writeRefused("without_" + id, without);
  }
  expectReaderAgrees();
}

TEST_F(MapFormatPage, NamesWhatIsRefusedInTheSections) {
  const RawFile quantized =
      test::takeApart(serialize(test::roomMap(), test::encodeAs(Encoding::kQuantized, 0.005)));
  const RawFile plain = test::takeApart(serialize(test::roomMap()));
  const auto changed = [&](const std::string& name, RawFile file, const char* id, std::size_t at,
                           auto value) {
    setNumber(file.section(id).payload, at, value);
    writeRefused(name, file);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  changed("extent", plain, "GEOM", 0, std::uint32_t{0});
  changed("voxel_size", plain, "GEOM", 12, nan);
  changed("transform", plain, "GEOM", 20, 1.7);
  changed("kind", plain, "FIEL", 0, std::uint8_t{2});
  changed("truncation", plain, "FIEL", 1, -0.1);
  changed("clamp", plain, "FIEL", 9, nan);
  changed("frame", plain, "FIEL", 29, std::uint8_t{0xFF});
  changed("text_size", plain, "META", 0, std::uint32_t{(16u << 20) + 1});
  changed("text", plain, "META", 0, std::uint32_t{5});
  changed("frames", plain, "AGRE", 4, std::uint32_t{(1u << 30) + 1});
  changed("widening", plain, "AGRE", 44, 0.9);
  changed("shift", plain, "AGRE", 52, -0.1);
  changed("cell", plain, "MASK", 0, std::uint32_t{0});
  changed("bucket", plain, "MASK", 4, std::uint32_t{77});
  changed("encoding", plain, "CORE", 0, std::uint8_t{4});
  changed("axes", plain, "CORE", 1, std::uint8_t{3});
  changed("rank", plain, "CORE", 4, std::uint32_t{0});
  changed("bytes", plain, "CORE", 4, std::uint32_t{2});
  changed("not_a_number", plain, "CORE", 12, std::numeric_limits<float>::quiet_NaN());
  changed("step", quantized, "CORE", 12, 0.0f);
  RawFile longer = quantized;
  longer.section("CORE").payload.push_back(0);
  writeRefused("left_over", longer);
  RawFile shorter = quantized;
  shorter.section("CORE").payload.pop_back();
  writeRefused("short", shorter);
  expectReaderAgrees();
}

}  // namespace
}  // namespace ttsdf
