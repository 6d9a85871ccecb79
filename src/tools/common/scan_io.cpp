#include "ttsdf_localization/tools/scan_io.h"

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/readers/cloud_file.h"

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) return cell;
  std::string result = "\"";
  for (const char c : cell) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

/// Words between blanks; a word may stand in double quotes, with blanks inside ("" or \\" is a quote).
std::vector<std::string> wordsOf(const std::string& line, const std::string& path, std::size_t number) {
  std::vector<std::string> words;
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  for (std::size_t n = 0; n < line.size();) {
    if (blank(line[n])) {
      ++n;
      continue;
    }
    if (line[n] == '#') break;  // a comment
    std::string word;
    if (line[n] != '"') {
      while (n < line.size() && !blank(line[n])) word += line[n++];
    } else {
      for (++n;; ++n) {
        if (n >= line.size()) {
          throw std::runtime_error("batch list '" + path + "', line " + std::to_string(number) +
                                   ": got a quote that does not end");
        }
        const bool escaped = n + 1 < line.size() && line[n + 1] == '"' && (line[n] == '\\' || line[n] == '"');
        if (escaped) ++n;
        if (line[n] == '"' && !escaped) break;
        word += line[n];
      }
      ++n;
      if (n < line.size() && !blank(line[n])) {
        throw std::runtime_error("batch list '" + path + "', line " + std::to_string(number) + ": got '" +
                                 line[n] + "' right behind a quote, wanted a blank");
      }
    }
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace

ScanPoints readScan(const std::string& path) { return readScanFile(path); }

std::vector<BatchEntry> readBatch(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("batch list '" + path + "': cannot read");
  std::vector<BatchEntry> entries;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.rfind("\xef\xbb\xbf", 0) == 0) line.erase(0, 3);  // some editors' mark of UTF-8
    if (line.find('\0') != std::string::npos) {
      throw std::runtime_error("batch list '" + path + "', line " + std::to_string(number) +
                               ": got a byte 0, wanted plain text");
    }
    const std::vector<std::string> words = wordsOf(line, path, number);
    if (words.empty()) continue;
    if (words.size() < 2 || words.size() > 3) {
      throw std::runtime_error("batch list '" + path + "', line " + std::to_string(number) + ": got " +
                               std::to_string(words.size()) +
                               " words, wanted: scan prior [truth] (names with blanks in double quotes)");
    }
    BatchEntry entry{words[0], words[1], std::nullopt};
    if (words.size() == 3 && words[2] != "-") entry.truth = words[2];
    entries.push_back(std::move(entry));
  }
  if (entries.empty())
    throw std::runtime_error("batch list '" + path + "': got no entry, wanted at least one");
  return entries;
}

std::string resolveBeside(const std::string& list_path, const std::string& name) {
  if (fs::exists(name)) return name;
  const fs::path beside = fs::path(list_path).parent_path() / name;
  return fs::exists(beside) ? beside.string() : name;
}

const char* const kRegistrationCsvHeader =
    "scan,prior,points,success,reason,iterations,rms_residual,inlier_ratio,ms,tx,ty,tz,qx,qy,qz,qw,"
    "translation_error,rotation_error,confidence,degenerate_directions,unmapped_ratio,explained_ratio,"
    "blocked_ratio,least_evidence,score";

void writeRow(std::ostream& out, const RegistrationRow& row) {
  const RegistrationResult& r = row.result;
  const Eigen::Vector3d t = r.T_map_sensor.translation();
  Eigen::Quaterniond q(r.T_map_sensor.linear());
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();  // one sign, so that equal poses give equal rows
  out << std::setprecision(9) << quoted(row.scan) << ',' << quoted(row.prior) << ',' << row.points << ','
      << (r.success ? 1 : 0) << ',' << (row.unreadable ? "unreadable" : name(r.reason)) << ',' << r.iterations
      << ',' << r.rms_residual << ',' << r.inlier_ratio << ',' << row.milliseconds << ',' << t.x() << ','
      << t.y() << ',' << t.z() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << q.w() << ',';
  if (row.error) out << row.error->translation;
  out << ',';
  if (row.error) out << row.error->rotation;
  out << ',' << r.confidence << ',' << r.degenerate_directions << ',' << r.unmappedRatio() << ','
      << r.explained_ratio << ',' << r.blocked_ratio << ',' << r.least_evidence << ',' << r.score << '\n';
}

void writeUncertaintyHeader(std::ostream& out) {
  out << "scan,degenerate_directions";
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) out << ",c" << a << b;
  }
  out << '\n';
}

void writeUncertainty(std::ostream& out, const RegistrationRow& row) {
  const bool known = row.result.success && !row.unreadable;
  out << std::setprecision(9) << quoted(row.scan) << ',';
  if (known) out << row.result.degenerate_directions;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) {
      out << ',';
      if (known) out << row.result.covariance(a, b);
    }
  }
  out << '\n';
}

}  // namespace ttsdf
