#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/evaluation/sweep.h"

namespace ttsdf {

namespace {

constexpr const char* kHeader =
    "dataset,method,scan,kind,magnitude,direction,translation_error,rotation_error,accepted,reason,"
    "iterations,ms,cpu_ms,dx,dy,dz,mahalanobis_squared,confidence";
constexpr std::size_t kColumns = 18;

std::string keyOf(const SweepRecord& record) {
  std::ostringstream key;
  key << record.dataset << ',' << record.method << ',' << record.scan << ',' << name(record.kind) << ','
      << std::llround(record.magnitude * 1e9) << ',' << record.direction;
  return key.str();
}

std::string toLine(const SweepRecord& r) {
  std::ostringstream line;
  line << std::setprecision(9) << r.dataset << ',' << r.method << ',' << r.scan << ',' << name(r.kind) << ','
       << r.magnitude << ',' << r.direction << ',' << r.translation_error << ',' << r.rotation_error << ','
       << (r.accepted ? 1 : 0) << ',' << r.reason << ',' << r.iterations << ',' << r.milliseconds << ','
       << r.cpu_milliseconds << ',' << r.offset.x() << ',' << r.offset.y() << ',' << r.offset.z() << ','
       << r.mahalanobis_squared << ',' << r.confidence << '\n';
  return line.str();
}

SweepRecord fromLine(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  if (cells.size() != kColumns) {
    throw std::runtime_error("got " + std::to_string(cells.size()) + " columns, wanted " +
                             std::to_string(kColumns));
  }
  SweepRecord r;
  try {
    r.dataset = cells[0];
    r.method = cells[1];
    r.scan = cells[2];
    r.kind = perturbationKindFromName(cells[3]);
    r.magnitude = std::stod(cells[4]);
    r.direction = std::stoi(cells[5]);
    r.translation_error = std::stod(cells[6]);
    r.rotation_error = std::stod(cells[7]);
    r.accepted = std::stoi(cells[8]) != 0;
    r.reason = cells[9];
    r.iterations = std::stoi(cells[10]);
    r.milliseconds = std::stod(cells[11]);
    r.cpu_milliseconds = std::stod(cells[12]);
    r.offset = {std::stod(cells[13]), std::stod(cells[14]), std::stod(cells[15])};
    r.mahalanobis_squared = std::stod(cells[16]);
    r.confidence = std::stod(cells[17]);
  } catch (const std::logic_error& error) {
    throw std::runtime_error("got a cell that is no number: " + line);
  }
  return r;
}

std::string readText(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw std::runtime_error("sweep log '" + path + "': cannot read");
  return text.str();
}

// Everything up to the last line feed: what follows was cut off.
std::string wholeLines(const std::string& text) { return text.substr(0, text.rfind('\n') + 1); }

std::vector<SweepRecord> parse(const std::string& path, const std::string& text) {
  std::vector<SweepRecord> records;
  std::istringstream lines(text);
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (number == 1) {
      if (line != kHeader) {
        throw std::runtime_error("sweep log '" + path + "': got header '" + line + "', wanted '" + kHeader +
                                 "'");
      }
      continue;
    }
    try {
      records.push_back(fromLine(line));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("sweep log '" + path + "', line " + std::to_string(number) + ": " +
                               error.what());
    }
  }
  return records;
}

}  // namespace

std::vector<SweepRecord> readSweepLog(const std::string& path) {
  return parse(path, wholeLines(readText(path)));
}

SweepLog::SweepLog(const std::string& path) : path_(path) {
  const std::string text = readText(path);
  const std::string whole = wholeLines(text);
  records_ = parse(path, whole);
  for (const auto& record : records_) keys_.insert(keyOf(record));
  if (whole.empty() || whole.size() != text.size()) {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out << (whole.empty() ? std::string(kHeader) + "\n" : whole);
    if (!out.flush()) throw std::runtime_error("sweep log '" + path + "': cannot write");
  }
}

bool SweepLog::contains(const SweepRecord& key) const { return keys_.count(keyOf(key)) > 0; }

void SweepLog::append(const SweepRecord& record) {
  for (const auto* label : {&record.dataset, &record.method, &record.scan}) {
    if (label->find_first_of(",\n\r\"") != std::string::npos) {
      throw std::invalid_argument("sweep log: got label '" + *label +
                                  "', wanted one without comma, quote or line end");
    }
  }
  std::ofstream out(path_, std::ios::binary | std::ios::app);
  out << toLine(record);
  if (!out.flush()) throw std::runtime_error("sweep log '" + path_ + "': cannot write");
  records_.push_back(record);
  keys_.insert(keyOf(record));
}

}  // namespace ttsdf
