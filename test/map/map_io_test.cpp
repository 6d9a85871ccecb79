#include <gtest/gtest.h>
#include <zlib.h>

#include "file_surgery.h"
#include "first_form.h"
#include "room_map.h"
#include "ttsdf_localization/compression/map_writer.h"

namespace ttsdf {
namespace {

using test::encodeAs;
using test::rmsDifference;
using test::rmsValue;
using test::roomMap;

TtSdfMap roundTrip(const TtSdfMap& map, const EncodeOptions& options) {
  const auto bytes = serialize(map, options);
  return deserialize(bytes.data(), bytes.size());
}

void expectSameFrame(const TtSdfMap& got, const TtSdfMap& wanted) {
  EXPECT_TRUE((got.geometry.dims == wanted.geometry.dims).all());
  EXPECT_EQ(got.geometry.voxel_size, wanted.geometry.voxel_size);
  EXPECT_EQ(got.geometry.T_map_grid.matrix(), wanted.geometry.T_map_grid.matrix());
  EXPECT_EQ(got.kind, wanted.kind);
  EXPECT_EQ(got.truncation, wanted.truncation);
  EXPECT_EQ(got.clamp_negative, wanted.clamp_negative);
  EXPECT_EQ(got.clamp_positive, wanted.clamp_positive);
  EXPECT_EQ(got.frame_id, wanted.frame_id);
  EXPECT_EQ(got.metadata, wanted.metadata);
  EXPECT_EQ(got.agreement.compared, wanted.agreement.compared);
  EXPECT_EQ(got.agreement.contradicting, wanted.agreement.contradicting);
  EXPECT_EQ(got.agreement.without_overlap, wanted.agreement.without_overlap);
  EXPECT_EQ(got.agreement.position_median, wanted.agreement.position_median);
  EXPECT_EQ(got.agreement.position_90, wanted.agreement.position_90);
  EXPECT_EQ(got.agreement.rotation_median, wanted.agreement.rotation_median);
  EXPECT_EQ(got.agreement.rotation_90, wanted.agreement.rotation_90);
  EXPECT_EQ(got.agreement.widening, wanted.agreement.widening);
  EXPECT_EQ(got.agreement.shift, wanted.agreement.shift);
  EXPECT_EQ(got.agreement.turn_sensor, wanted.agreement.turn_sensor);
  EXPECT_EQ(got.agreement.turn_scene, wanted.agreement.turn_scene);
  ASSERT_EQ(got.agreement.viewpoints.size(), wanted.agreement.viewpoints.size());
  if (!wanted.agreement.viewpoints.empty()) {
    EXPECT_EQ(got.agreement.viewpoint_distance, wanted.agreement.viewpoint_distance);
  }
  for (std::size_t n = 0; n < wanted.agreement.viewpoints.size(); ++n) {
    const ViewpointAgreement &a = got.agreement.viewpoints[n], &b = wanted.agreement.viewpoints[n];
    // As finely as the section stores them.
    EXPECT_LT((a.viewpoint.position - b.viewpoint.position).norm(),
              0.1 * wanted.agreement.viewpoint_distance);
    EXPECT_LT((a.viewpoint.view - b.viewpoint.view).norm(), 0.01);
    EXPECT_EQ(a.frames, b.frames);
    EXPECT_NEAR(a.ratio / b.ratio, 1.0, 0.03);
  }
  EXPECT_EQ(got.mask.bits(), wanted.mask.bits());
  EXPECT_EQ(got.mask.cellVoxels(), wanted.mask.cellVoxels());
  EXPECT_EQ(got.train.axes(), wanted.train.axes());
}

TEST(MapIo, Float32IsExact) {
  TtSdfMap map = roomMap();
  map.kind = FieldKind::kTsdf;
  const TtSdfMap read = roundTrip(map, {});
  expectSameFrame(read, map);
  EXPECT_EQ(read.train.first(), map.train.first());
  EXPECT_EQ(read.train.middle(), map.train.middle());
  EXPECT_EQ(read.train.last(), map.train.last());
}

TEST(MapIo, Float16KeepsElevenBitsOfEveryCoreEntry) {
  const TtSdfMap map = roomMap();
  const TtSdfMap read = roundTrip(map, encodeAs(Encoding::kFloat16));
  expectSameFrame(read, map);
  const auto check = [](const Eigen::MatrixXf& got, const Eigen::MatrixXf& wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    // Half a unit in the last of 11 bits; below 2^-14 half of the smallest subnormal.
    const auto allowed = wanted.array().abs().max(6.2e-5f) * 4.8829e-4f;
    EXPECT_TRUE(((got - wanted).array().abs() <= allowed).all());
  };
  check(read.train.first(), map.train.first());
  check(read.train.middle(), map.train.middle());
  check(read.train.last(), map.train.last());
}

TEST(MapIo, QuantizedKeepsEverythingButTheCores) {
  const TtSdfMap map = roomMap();
  expectSameFrame(roundTrip(map, encodeAs(Encoding::kQuantized)), map);
}

TEST(MapIo, MapsWithoutMaskAndMetadataStayWithout) {
  TtSdfMap map = roomMap();
  map.mask = {};
  map.metadata.clear();
  map.agreement = {};
  const TtSdfMap read = roundTrip(map, {});
  EXPECT_TRUE(read.mask.empty());
  EXPECT_FALSE(read.agreement.known());
  EXPECT_TRUE(read.metadata.empty());
}

TEST(MapIo, EveryModeOrderSurvives) {
  const DenseTensor tensor = test::roomTensor(Dims(9, 7, 8));
  for (const ModeOrder& axes :
       {ModeOrder{{0, 1, 2}}, ModeOrder{{1, 0, 2}}, ModeOrder{{2, 0, 1}}, ModeOrder{{0, 2, 1}}}) {
    TtSdfMap map = roomMap(Dims(9, 7, 8), 3);
    TtSvdOptions options;
    options.axes = axes;
    map.train = ttSvd(tensor, options).train;
    for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
      const TtSdfMap read = roundTrip(map, encodeAs(encoding, 1e-4));
      EXPECT_EQ(read.train.axes(), axes);
      EXPECT_LT(rmsDifference(read.train, map.train), 3e-4);
    }
  }
}

TEST(MapIo, ModesOfLengthOneAndEmptyFieldsWork) {
  for (const Dims& dims : {Dims(1, 1, 1), Dims(1, 9, 7), Dims(9, 1, 7), Dims(9, 7, 1)}) {
    for (const float value : {0.0f, 0.25f}) {
      TtSdfMap map = roomMap(dims, 3);
      map.train = ttSvd(DenseTensor(dims, value), {}).train;
      for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
        const TtSdfMap read = roundTrip(map, encodeAs(encoding, 1e-3));
        EXPECT_LE(rmsDifference(read.train, map.train), 1e-3);
      }
    }
  }
}

TEST(MapIo, EqualMapsGiveEqualBytes) {
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    EXPECT_EQ(serialize(roomMap(), encodeAs(encoding)), serialize(roomMap(), encodeAs(encoding)));
  }
}

TEST(MapIo, InfoTellsEncodingSizeAndChecksum) {
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    const auto bytes = serialize(roomMap(), encodeAs(encoding));
    const MapFileInfo info = fileInfo(bytes.data(), bytes.size());
    EXPECT_EQ(info.encoding, encoding);
    EXPECT_EQ(info.file_bytes, bytes.size());
    EXPECT_EQ(encodedSize(roomMap(), encodeAs(encoding)), bytes.size());
    char id[9];
    std::snprintf(id, sizeof(id), "%08lx", crc32(0, bytes.data(), static_cast<uInt>(bytes.size())));
    EXPECT_EQ(info.map_id, id);
  }
}

TEST(MapIo, NamesOfEncodingsAreTheirOwnInverse) {
  for (const Encoding encoding : {Encoding::kFloat32, Encoding::kFloat16, Encoding::kQuantized}) {
    EXPECT_EQ(encodingFromName(name(encoding)), encoding);
  }
  EXPECT_THROW(encodingFromName("float64"), std::invalid_argument);
}

TEST(MapIo, RefusesMapsThatNoReaderWouldAccept) {
  const auto refused = [](const auto& spoil) {
    TtSdfMap map = roomMap();
    spoil(map);
    EXPECT_THROW(serialize(map), std::invalid_argument);
  };
  refused([](TtSdfMap& map) { map.train = {}; });
  refused([](TtSdfMap& map) { map.geometry.dims[0] = 31; });
  refused([](TtSdfMap& map) { map.geometry.voxel_size = 0.0; });
  refused([](TtSdfMap& map) { map.truncation = -1.0; });
  refused([](TtSdfMap& map) { map.clamp_positive = std::nan(""); });
  refused([](TtSdfMap& map) { map.mask = test::roomMask(Dims(10, 10, 10), 2); });
  refused([](TtSdfMap& map) { map.frame_id = "\xFF"; });
  refused([](TtSdfMap& map) { map.metadata["half a character"] = "\xC3"; });
  refused([](TtSdfMap& map) { map.metadata["surrogate"] = "\xED\xA0\x80"; });
  refused([](TtSdfMap& map) {
    Eigen::MatrixXf last = map.train.last();
    last(0, 0) = std::nanf("");
    map.train = TensorTrain(map.train.axes(), map.train.first(), map.train.middle(), last);
  });
}

TEST(MapIo, RefusesRanksAboveWhatTheModesAllow) {
  TtSdfMap map = roomMap(Dims(5, 4, 6), 4);
  for (int n = 0; n < 2; ++n) map.train = add(map.train, map.train);
  EXPECT_THROW(serialize(map), std::invalid_argument);
  EXPECT_THROW(serialize(map, encodeAs(Encoding::kQuantized)), std::invalid_argument);
}

TEST(MapIo, Float16RefusesWhatItCannotHold) {
  TtSdfMap map = roomMap();
  map.train = scale(map.train, 1e8f);
  EXPECT_THROW(serialize(map, encodeAs(Encoding::kFloat16)), std::invalid_argument);
}

TEST(MapIo, ReadsWhatTheFirstReleaseWrote) {
  const auto& bytes = test::kFirstForm;
  const TtSdfMap map = deserialize(bytes.data(), bytes.size());
  EXPECT_EQ(fileInfo(bytes.data(), bytes.size()).encoding, Encoding::kQuantizedFirst);
  EXPECT_STREQ(name(Encoding::kQuantizedFirst), "quantized-1");
  EXPECT_EQ(map.train.rank1(), 4);
  EXPECT_EQ(map.train.rank2(), 6);
  // As the first release read it.
  EXPECT_NEAR(map.train(3, 4, 5), 0.187685f, 2e-6f);
  EXPECT_NEAR(map.train(20, 30, 10), 0.197777f, 2e-6f);
  EXPECT_NEAR(map.train(44, 55, 45), 0.019891f, 2e-6f);
  EXPECT_NEAR(map.train(10, 40, 33), 0.136895f, 2e-6f);
  EXPECT_TRUE(map.mask.atVoxel(10, 40, 33));
  EXPECT_FALSE(map.mask.atVoxel(3, 4, 5));
  // Written again it is of today's form, whatever the caller asks for.
  const auto today = serialize(map, encodeAs(Encoding::kQuantizedFirst, 1e-4));
  EXPECT_EQ(fileInfo(today.data(), today.size()).encoding, Encoding::kQuantized);
}

/// The message of what is refused; "" if it is read.
std::string refusal(const std::vector<std::uint8_t>& bytes, const MapLimits& limits) {
  try {
    deserialize(bytes.data(), bytes.size(), limits);
    return "";
  } catch (const MapFormatError& error) {
    return error.what();
  }
}

TEST(MapIo, ReadingIsBoundedByTheLimits) {
  const auto bytes = serialize(roomMap(), encodeAs(Encoding::kQuantized, 1e-3));
  const auto voxels = static_cast<double>(roomMap().geometry.voxelCount());
  EXPECT_EQ(refusal(bytes, {}), "");
  EXPECT_NE(refusal(bytes, {256.0, voxels - 1.0}).find("max_map_voxels"), std::string::npos);
  EXPECT_EQ(refusal(bytes, {256.0, voxels}), "");
  EXPECT_NE(refusal(bytes, {0.001, 1e9}).find("max_map_megabytes"), std::string::npos);
}

TEST(MapIo, FewBytesCannotAskForLargeCores) {
  // A field of one value has all its numbers in a few bytes; the ranks of the header claim a million.
  TtSdfMap map = roomMap(Dims(120, 60, 120), 1);
  map.mask = {};
  map.metadata.clear();
  test::RawFile file = test::takeApart(serialize(map, encodeAs(Encoding::kQuantized, 0.1)));
  auto& core = file.section("CORE").payload;
  test::setNumber(core, 4, std::uint32_t{100});
  test::setNumber(core, 8, std::uint32_t{100});
  EXPECT_NE(refusal(test::putTogether(file), {}).find("numbers of the cores"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf
