#include "ttsdf_localization/tools/scan_io.h"

#include <pcl/console/print.h>
#include <pcl/exceptions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

namespace fs = std::filesystem;

namespace {

ScanPoints readBinary(const std::string& path) {
  constexpr std::uintmax_t kPointBytes = 3 * sizeof(float);
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error) throw std::runtime_error("scan '" + path + "': cannot read: " + error.message());
  if (bytes % kPointBytes != 0) {
    throw std::runtime_error("scan '" + path + "': got " + std::to_string(bytes) +
                             " bytes, wanted a multiple of 12 (float32 x y z)");
  }
  ScanPoints points(3, static_cast<Eigen::Index>(bytes / kPointBytes));
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(points.data()), static_cast<std::streamsize>(bytes));
  if (!in) throw std::runtime_error("scan '" + path + "': cannot read");
  return points;
}

/// PCL writes its complaints to the console; the exceptions here say what matters.
class QuietPcl {
 public:
  QuietPcl() { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
  ~QuietPcl() { pcl::console::setVerbosityLevel(verbosity_); }

 private:
  pcl::console::VERBOSITY_LEVEL verbosity_ = pcl::console::getVerbosityLevel();
};

template <class Reader>
pcl::PCLPointCloud2 readBlob(const std::string& path, const char* format) {
  const QuietPcl quiet;
  Reader reader;
  pcl::PCLPointCloud2 blob;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0, type = 0;
  unsigned int data_start = 0;
  // The header first: PCL's readers crash on a file that names no field.
  const int header = reader.readHeader(path, blob, origin, orientation, version, type, data_start);
  if (header < 0 || blob.fields.empty()) {
    throw std::runtime_error("scan '" + path + "': got no " + format + " header");
  }
  for (const char* field : {"x", "y", "z"}) {
    if (pcl::getFieldIndex(blob, field) < 0) {
      throw std::runtime_error("scan '" + path + "': got no field '" + field + "', wanted x, y and z");
    }
  }
  if (reader.read(path, blob, origin, orientation, version) < 0) {
    throw std::runtime_error("scan '" + path + "': got a damaged " + format + " file");
  }
  return blob;
}

ScanPoints readWithPcl(const std::string& path, bool pcd) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  try {
    pcl::fromPCLPointCloud2(
        pcd ? readBlob<pcl::PCDReader>(path, "PCD") : readBlob<pcl::PLYReader>(path, "PLY"), cloud);
  } catch (const pcl::PCLException& error) {
    throw std::runtime_error("scan '" + path + "': " + error.what());
  }
  ScanPoints points(3, static_cast<Eigen::Index>(cloud.size()));
  for (Eigen::Index n = 0; n < points.cols(); ++n)
    points.col(n) = cloud[static_cast<std::size_t>(n)].getVector3fMap();
  return points;
}

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) return cell;
  std::string result = "\"";
  for (const char c : cell) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

}  // namespace

ScanPoints readScan(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (!fs::is_regular_file(path)) throw std::runtime_error("scan '" + path + "': got no such file");
  if (extension == ".bin") return readBinary(path);
  if (extension == ".pcd" || extension == ".ply") return readWithPcl(path, extension == ".pcd");
  throw std::runtime_error("scan '" + path + "': got ending '" + extension + "', wanted .pcd, .ply or .bin");
}

std::vector<BatchEntry> readBatch(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("batch list '" + path + "': cannot read");
  std::vector<BatchEntry> entries;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    if (words.empty() || words[0][0] == '#') continue;
    if (words.size() < 2 || words.size() > 3) {
      throw std::runtime_error("batch list '" + path + "', line " + std::to_string(number) + ": got " +
                               std::to_string(words.size()) + " words, wanted: scan prior [truth]");
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
