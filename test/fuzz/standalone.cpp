// For compilers without libFuzzer: runs a target over files, and over random changes of them.
//
// usage: <target> [-runs=N] [-max_total_time=S] [-seed=N] FILE|FOLDER...

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

void readInputs(const std::filesystem::path& path, std::vector<Bytes>& inputs) {
  if (std::filesystem::is_directory(path)) {
    for (const auto& entry : std::filesystem::directory_iterator(path)) readInputs(entry.path(), inputs);
    return;
  }
  std::ifstream file(path, std::ios::binary);
  inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

void change(Bytes& bytes, std::mt19937& random) {
  static const std::uint8_t kOdd[] = {0x00, 0x01, 0x7F, 0x80, 0xFF};
  for (unsigned n = 1 + random() % 4; n > 0 && !bytes.empty(); --n) {
    const std::size_t at = random() % bytes.size();
    switch (random() % 6) {
      case 0:
        bytes[at] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        bytes[at] ^= static_cast<std::uint8_t>(1U << (random() % 8));
        break;
      case 2:
        for (std::size_t k = at; k < std::min(at + 1 + random() % 8, bytes.size()); ++k)
          bytes[k] = kOdd[random() % 5];
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), 1 + random() % 16, kOdd[random() % 5]);
        break;
      default:
        bytes.erase(
            bytes.begin() + static_cast<std::ptrdiff_t>(at),
            bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + 1 + random() % 16, bytes.size())));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  long runs = 0, seconds = 0;
  unsigned seed = 1;
  std::vector<Bytes> inputs;
  for (int n = 1; n < argc; ++n) {
    const std::string argument = argv[n];
    if (argument.rfind("-runs=", 0) == 0) {
      runs = std::atol(argument.c_str() + 6);
    } else if (argument.rfind("-max_total_time=", 0) == 0) {
      seconds = std::atol(argument.c_str() + 16);
    } else if (argument.rfind("-seed=", 0) == 0) {
      seed = static_cast<unsigned>(std::atol(argument.c_str() + 6));
    } else if (argument[0] != '-') {
      readInputs(argument, inputs);
    }
  }
  if (inputs.empty()) {
    std::fprintf(stderr, "usage: %s [-runs=N] [-max_total_time=S] [-seed=N] FILE|FOLDER...\n", argv[0]);
    return 2;
  }
  for (const Bytes& input : inputs) LLVMFuzzerTestOneInput(input.data(), input.size());
  std::mt19937 random(seed);
  const auto begin = std::chrono::steady_clock::now();
  const auto over = [&](long done) {
    if (runs > 0 && done >= runs) return true;
    if (seconds > 0 && done % 64 == 0)
      return std::chrono::steady_clock::now() - begin > std::chrono::seconds(seconds);
    return runs == 0 && seconds == 0;
  };
  long done = 0;
  for (; !over(done); ++done) {
    Bytes bytes = inputs[random() % inputs.size()];
    change(bytes, random);
    // What ends the process is found again: the seed and the number of the run make the input.
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%zu inputs, %ld changed ones, nothing found\n", inputs.size(), done);
  return 0;
}
