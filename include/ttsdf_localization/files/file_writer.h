#pragma once
// Files that are whole or not there: written to a temporary beside the target, forced to the disk, read back,
// renamed. An interrupted or failed save leaves the old file; the next one removes what a killed writer left
// behind.
//
// The target may be nothing, a regular file or a link to either (the link stays, what it points to is
// replaced). A device, a pipe, a socket or a folder is refused, and so is a file that holds something else
// than what is saved. Owner and mode of a replaced file are kept, as far as the system lets.

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace ttsdf {

/// What a file holds, known by its first bytes. An empty magic stands for any file: nothing is asked of an
/// old one.
struct FileKind {
  std::string name;   ///< for messages: "a map"
  std::string magic;  ///< first bytes of every file of the kind
};

/// Not thread-safe; two writers of one target do not disturb each other, the later commit stays.
class FileWriter {
 public:
  /// Makes the empty temporary. Throws std::runtime_error naming the path and what stands in the way.
  explicit FileWriter(std::string path, const FileKind& kind = {});
  /// Without commit() the temporary goes and the target is as it was.
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  /// The file to write to, by its name or by its descriptor.
  const std::string& temporary() const { return temporary_; }
  int descriptor() const { return fd_; }

  /// fsync, `check` (reads the temporary back and throws if it is not what was written), rename, fsync of the
  /// folder. Throws std::runtime_error naming the path.
  void commit(const std::function<void()>& check = {});

 private:
  [[noreturn]] void fail(int error) const;
  void makeTemporary();

  const std::string path_;  ///< as given, for messages
  std::string target_;      ///< links followed
  std::string temporary_;
  int fd_ = -1;
};

/// A text file in this way: stream() until close().
class OutputFile {
 public:
  /// An empty path: nothing is written. Throws std::runtime_error naming the path, as close() does.
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  std::ostream& stream() { return stream_; }
  void close();

 private:
  std::unique_ptr<FileWriter> writer_;
  std::ofstream stream_;
};

/// Throws std::runtime_error naming the path; the old file stays. The bytes are not copied.
void writeFileAtomically(const std::string& path, const void* bytes, std::size_t size,
                         const FileKind& kind = {});
void writeFileAtomically(const std::string& path, const std::vector<std::uint8_t>& bytes,
                         const FileKind& kind = {});

/// Throws std::runtime_error unless writeFileAtomically could begin: asked before hours of work, not after
/// them.
void requireWritable(const std::string& path, const FileKind& kind = {});

/// The file that a writer of `path` makes or replaces, whatever way it is spelled: absolute, links followed
/// (those to nothing, too), without `.` and `..`. Throws std::runtime_error naming the path.
std::string targetOf(const std::string& path);

/// The file that `path` names, links followed, if it lies in `folder` (links followed, too); an empty folder:
/// anywhere. Throws std::invalid_argument for a path that is not absolute, has a `..` or leads out. `what` is
/// for the message.
std::string pathInFolder(const std::string& what, const std::string& path, const std::string& folder);

}  // namespace ttsdf
