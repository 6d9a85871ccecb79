// Maps made from maps: lower ranks, another encoding, a part, two in one.

#include <iostream>
#include <sstream>

#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/tools/command_line.h"
#include "ttsdf_localization/tools/map_edit.h"
#include "ttsdf_localization/tools/progress.h"

namespace {

struct Arguments {
  std::string input, output, max_rank, encoding, crop, merge, transform;
  double tolerance = 0.0, quantization_rms = 0.0;
};

void declare(ttsdf::CommandLine& line, Arguments& a) {
  line.positional("MAP.ttsdf", a.input)
      .value("output", "OUT.ttsdf", a.output, "The new map.")
      .value("max-rank", "R[,R2]", a.max_rank, "Cap on the ranks.")
      .value("tolerance", "E", a.tolerance,
             "Relative error (Frobenius norm) that lower ranks may cost; 0: none.")
      .value("encoding", "NAME", a.encoding, "float32 | float16 | quantized (default: as the input).")
      .value("quantization", "METRES", a.quantization_rms,
             "Encoding quantized: rms error allowed; 0: a small one.")
      .value("crop", "X0,Y0,Z0,X1,Y1,Z1", a.crop, "Keeps the part in this box of the map frame [m].")
      .value("merge", "OTHER.ttsdf", a.merge, "Joins another map to it.")
      .value("transform", "FILE.txt", a.transform,
             "4x4 row-major: frame of the other map -> frame of the first (default: they are the same).");
}

int parseRank(const std::string& text) {
  std::size_t used = 0;
  int rank = 0;
  try {
    rank = std::stoi(text, &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (used != text.size() || rank < 1) {
    throw ttsdf::UsageError("--max-rank: got '" + text + "', wanted whole numbers from 1, R or R1,R2");
  }
  return rank;
}

ttsdf::TtSvdOptions ranks(const Arguments& a) {
  ttsdf::TtSvdOptions options;
  if (!(a.tolerance >= 0.0 && a.tolerance < 1.0)) throw ttsdf::UsageError("--tolerance: wanted 0 <= E < 1");
  options.tolerance = a.tolerance;
  if (a.max_rank.empty()) return options;
  const auto comma = a.max_rank.find(',');
  options.max_rank1 = parseRank(a.max_rank.substr(0, comma));
  options.max_rank2 =
      comma == std::string::npos ? options.max_rank1 : parseRank(a.max_rank.substr(comma + 1));
  return options;
}

ttsdf::EncodeOptions encoding(const Arguments& a, ttsdf::Encoding of_input) {
  ttsdf::EncodeOptions options{of_input, a.quantization_rms};
  try {
    if (!a.encoding.empty()) options.encoding = ttsdf::encodingFromName(a.encoding);
  } catch (const std::invalid_argument& error) {
    throw ttsdf::UsageError(error.what());
  }
  return options;
}

Eigen::AlignedBox3d box(const std::string& text) {
  const auto n = ttsdf::parseNumbers("crop", text, 6);
  return {Eigen::Vector3d(n[0], n[1], n[2]), Eigen::Vector3d(n[3], n[4], n[5])};
}

int run(int argc, char** argv) {
  Arguments a;
  ttsdf::CommandLine line(
      "ttsdf_convert", "MAP.ttsdf --output OUT.ttsdf [options]",
      "Makes a map from a map: joined with another, cut, of lower rank, in another encoding; in this "
      "order.");
  declare(line, a);
  if (!line.parse(argc, argv, std::cout)) return 0;
  if (a.output.empty()) throw ttsdf::UsageError("--output is missing");
  if (!a.transform.empty() && a.merge.empty())
    throw ttsdf::UsageError("--transform: wanted together with --merge");
  const auto options = ranks(a);
  ttsdf::Progress progress("ttsdf_convert");
  auto map = ttsdf::loadMap(a.input);  // its errors name the file
  const auto bytes = ttsdf::readFile(a.input);
  const auto encode = encoding(a, ttsdf::fileInfo(bytes.data(), bytes.size()).encoding);
  if (!a.merge.empty()) {
    progress.update("merging", 0.25);
    const Eigen::Isometry3d T_first_other =
        a.transform.empty() ? Eigen::Isometry3d::Identity() : ttsdf::readPose(a.transform);
    map = ttsdf::merged(map, ttsdf::loadMap(a.merge), T_first_other, options);
  }
  progress.update("cutting and compressing", 0.5);
  if (!a.crop.empty()) map = ttsdf::cropped(map, box(a.crop));
  if (line.given("max-rank") || line.given("tolerance")) map = ttsdf::recompressed(map, options);
  progress.update("encoding", 0.75);
  ttsdf::saveMap(map, a.output, encode);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runTool("ttsdf_convert", [&] { return run(argc, argv); });
}
