#include "ttsdf_localization/evaluation/method_memory.h"

#include <malloc.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace {

constexpr const char* kMemoryHeader = "dataset,method,paper_bytes,memory_bytes";

MethodMemory memoryFromLine(const std::string& line) {
  std::istringstream cells(line);
  MethodMemory row;
  char comma = 0;
  const bool labels = std::getline(cells, row.dataset, ',') && std::getline(cells, row.method, ',');
  if (!labels || !(cells >> row.paper_bytes >> comma >> row.memory_bytes)) {
    throw std::runtime_error("got '" + line + "', wanted the columns " + kMemoryHeader);
  }
  return row;
}

}  // namespace

std::size_t heapBytes() {
#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
#elif defined(__GLIBC__)
  const auto info = ::mallinfo();  // counts up to 4 GB
  return static_cast<unsigned>(info.uordblks) + static_cast<std::size_t>(static_cast<unsigned>(info.hblkhd));
#else
  return 0;
#endif
}

std::vector<MethodMemory> readMethodMemory(const std::string& path) {
  std::vector<MethodMemory> rows;
  if (!std::filesystem::exists(path)) return rows;
  std::ifstream in(path);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    try {
      if (number > 1) {
        rows.push_back(memoryFromLine(line));
      } else if (line != kMemoryHeader) {
        throw std::runtime_error("got '" + line + "', wanted '" + kMemoryHeader + "'");
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("map memory '" + path + "', line " + std::to_string(number) + ": " +
                               error.what());
    }
  }
  return rows;
}

void recordMethodMemory(const std::string& path, const MethodMemory& row) {
  auto rows = readMethodMemory(path);
  const auto same = std::find_if(rows.begin(), rows.end(), [&row](const MethodMemory& other) {
    return other.dataset == row.dataset && other.method == row.method;
  });
  if (same != rows.end()) {
    *same = row;
  } else {
    rows.push_back(row);
  }
  std::ofstream out(path, std::ios::trunc);
  out << kMemoryHeader << '\n';
  for (const auto& r : rows) {
    out << r.dataset << ',' << r.method << ',' << r.paper_bytes << ',' << r.memory_bytes << '\n';
  }
  if (!out.flush()) throw std::runtime_error("map memory '" + path + "': cannot write");
}

}  // namespace ttsdf
