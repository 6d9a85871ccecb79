#pragma once
// Probability of the next bit of a coded stream, mixed from several contexts (logistic mixing, Mahoney 2005).
// Whole numbers only: reader and writer must agree to the last bit on every machine.

#include <array>
#include <cstdint>
#include <vector>

namespace ttsdf {

constexpr int kContexts = 8;

class BitModel {
 public:
  /// `places`: how many places the table of each context has; `sets`: how many sets of mixing weights.
  BitModel(std::size_t places, std::size_t sets);
  /// As if nothing had been learned. A model takes most of a megabyte: one for several streams saves time.
  void forget();

  /// Probability of a 1 in 4096ths, from 1 to 4095. The places, one per context, must be below `places`.
  int predict(const std::array<std::uint32_t, kContexts>& places, std::size_t set);
  /// What the bit was.
  void learn(bool bit);

 private:
  using Counter = std::uint32_t;

  std::size_t places_per_context_;
  std::vector<Counter> counters_;
  std::vector<std::int32_t> weights_;
  std::array<Counter*, kContexts> active_{};
  std::array<std::int32_t, kContexts> inputs_{};
  std::int32_t* active_weights_ = nullptr;
  int mixed_ = 2048;
};

}  // namespace ttsdf
