// From a sampled field to an encoded map.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "field_slabs.h"
#include "ttsdf_localization/compression/compact_map.h"
#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

namespace {

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

void reportProgress(const BuildProgress& progress, const char* step, double share) {
  if (progress && !progress(step, share)) throw std::runtime_error("cancelled");
}

TensorTrain decompose(const FieldSlabs& slabs, const RankCaps& ranks, const BuildOptions& options,
                      const BuildProgress& progress) {
  TtSvdOptions svd;
  svd.max_rank1 = ranks.r1;
  svd.max_rank2 = ranks.r2;
  svd.tolerance = options.tolerance;
  svd.threads = options.threads;
  TensorTrain plain = ttSvd(slabs.dims(), slabs.values(), svd).train;
  if (options.refine_iterations == 0) return plain;
  WeightedFitOptions fit;
  fit.iterations = options.refine_iterations;
  fit.threads = options.threads;
  fit.keep_going = [&progress](double share) { return !progress || progress("refining", share); };
  return fitWeighted(slabs.weighted(), plain, fit);
}

/// Bytes of the map, and the map as a reader of them sees it.
void encode(const TtSdfMap& map, const FieldSlabs& slabs, const FieldError& error,
            const BuildOptions& options, bool meet_budget, const BuildProgress& progress, BuiltMap& built) {
  const Encoding encoding = encodingFromName(options.encoding);
  if (encoding == Encoding::kQuantized && options.refine_iterations > 0) {
    // Shares of the error that the ranks leave. With ranks as given, the encoding adds little to it; within a
    // budget, higher ranks stored more coarsely are better than lower ones stored finely.
    constexpr double kShareOfRanks = 0.5, kShareInBudget = 1.5;
    constexpr double kFinest = 1e-5;  // [m]
    const bool budget = options.target_bytes > 0 || options.target_surface_error > 0.0;
    CompactOptions compact;
    compact.threshold = std::max((budget ? kShareInBudget : kShareOfRanks) * error.surface, kFinest);
    if (options.quantization > 0.0) compact.threshold = options.quantization;
    compact.threads = options.threads;
    compact.keep_going = [&progress](double share) { return !progress || progress("encoding", share); };
    if (meet_budget) {
      compact.target_bytes = static_cast<std::size_t>(options.target_bytes);
      if (options.target_bytes == 0) compact.target_error = options.target_surface_error;
      compact.error = [&slabs](const TensorTrain& train) { return slabs.compare(train).surface; };
    }
    CompactMap result = compactMap(map, slabs.weighted(), compact);
    built.bytes = std::move(result.bytes);
    built.map = std::move(result.map);
    return;
  }
  EncodeOptions plain;
  plain.encoding = encoding;
  plain.quantization_rms = options.quantization > 0.0 ? options.quantization : 0.25 * error.total_rms;
  built.bytes = serialize(map, plain);
  built.map = deserialize(built.bytes.data(), built.bytes.size());
}

BuiltMap compressAt(const SampledField& field, const FusionOptions& fusion, const BuildOptions& options,
                    const RankCaps& ranks, bool meet_budget, const BuildProgress& progress) {
  BuiltMap built;
  reportProgress(progress, "decomposing", 0.0);
  const Stopwatch decomposing;
  TtSdfMap map;
  const FieldSlabs slabs(field, options);
  map.train = decompose(slabs, ranks, options, progress);
  map.geometry = field.geometry;
  if (options.support_mask) map.mask = field.mask;
  map.kind = fieldKindFromName(options.field);
  map.truncation = fusion.truncation;
  map.clamp_negative = options.clamp_negative;
  map.clamp_positive = options.clamp_positive;
  map.frame_id = field.frame_id;
  map.agreement = field.agreement;
  built.report.seconds["decompose"] = decomposing.seconds();

  reportProgress(progress, "encoding", 0.0);
  const Stopwatch encoding;
  const FieldError before = slabs.compare(map.train);
  BuildReport& report = built.report;
  report.agreement = field.agreement;
  report.rank1 = map.train.rank1();
  report.rank2 = map.train.rank2();
  report.encoding = options.encoding;
  report.dense_bytes = field.geometry.voxelCount() * sizeof(float);
  report.observed_share = slabs.knownShare();
  map.metadata["observed_share"] = std::to_string(report.observed_share);
  map.metadata["surface_rms_before_encoding"] = std::to_string(before.surface);
  encode(map, slabs, before, options, meet_budget, progress, built);
  const FieldError after = slabs.compare(built.map.train);
  report.relative_error = after.relative;
  report.surface_rms = after.surface;
  report.file_bytes = built.bytes.size();
  report.memory_bytes = built.map.train.memoryBytes() + built.map.mask.memoryBytes();
  report.seconds["encode"] = encoding.seconds();
  reportProgress(progress, "encoding", 1.0);
  return built;
}

/// The best map within a budget: file size rises and the error falls with the rank. Doubles the rank until
/// the budget is passed, then bisects. `fits` says whether a map keeps to the budget; `want_smallest`: the
/// smallest rank that fits, else the largest.
template <class Fits>
BuiltMap compressWithin(const SampledField& field, const FusionOptions& fusion, const BuildOptions& options,
                        bool want_smallest, const Fits& fits, const BuildProgress& progress) {
  constexpr int kFirstRank = 8, kLargestRank = 128;
  const int largest = std::min(kLargestRank, field.geometry.dims.maxCoeff());
  int below = 0, above = largest + 1;  // of the smallest rank that fits, or of the largest
  std::optional<BuiltMap> best;
  int best_rank = 0;
  BuildReport last;
  while (above - below > 1) {
    const int rank =
        above > largest ? std::min(std::max(kFirstRank, 2 * below), largest) : (below + above) / 2;
    BuiltMap built = compressAt(field, fusion, options, {rank, rank}, false, progress);
    last = built.report;
    const bool good = fits(built);
    if (good) best = std::move(built), best_rank = rank;
    (good == want_smallest ? above : below) = rank;
  }
  if (best) {
    // Ranks come in steps; the coarseness of what is stored fills the budget.
    BuiltMap met = compressAt(field, fusion, options, {best_rank, best_rank}, true, progress);
    const bool better = want_smallest ? met.bytes.size() < best->bytes.size()
                                      : met.report.surface_rms < best->report.surface_rms;
    return fits(met) && better ? std::move(met) : std::move(*best);
  }
  std::ostringstream text;
  text << "compress: got " << last.file_bytes << " bytes and " << last.surface_rms
       << " m rms near the surface at rank " << last.rank1 << ", wanted at most ";
  if (want_smallest) {
    text << options.target_surface_error << " m";
  } else {
    text << options.target_bytes << " bytes";
  }
  throw std::runtime_error(text.str());
}

}  // namespace

BuiltMap compress(const SampledField& field, const FusionOptions& fusion, const BuildOptions& options,
                  const BuildProgress& progress) {
  validate(options);
  if (options.target_bytes > 0) {
    return compressWithin(
        field, fusion, options, false,
        [&](const BuiltMap& b) { return b.bytes.size() <= static_cast<std::size_t>(options.target_bytes); },
        progress);
  }
  if (options.target_surface_error > 0.0) {
    return compressWithin(
        field, fusion, options, true,
        [&](const BuiltMap& b) { return b.report.surface_rms <= options.target_surface_error; }, progress);
  }
  return compressAt(field, fusion, options, parseRanks(options.max_rank), false, progress);
}

BuiltMap buildMap(const TsdfVolume& volume, const BuildOptions& options, const BuildProgress& progress,
                  const FrameAgreement& agreement) {
  reportProgress(progress, "distance field", 0.0);
  const Stopwatch sampling;
  SampledField field = sampleField(volume, options, progress);
  field.agreement = agreement;
  const double seconds = sampling.seconds();
  BuiltMap built = compress(field, volume.options(), options, progress);
  built.report.seconds["distance_field"] = seconds;
  built.report.frames = volume.frameCount();
  return built;
}

}  // namespace ttsdf
