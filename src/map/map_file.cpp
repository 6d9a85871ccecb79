// Map files on disk.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>

#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

namespace {

[[noreturn]] void fail(const std::string& action, const std::string& path, int error) {
  throw std::runtime_error("cannot " + action + " '" + path + "': " + std::strerror(error));
}

/// A file descriptor that closes itself.
class File {
 public:
  File(const std::string& path, int flags, mode_t mode = 0)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return fd_; }
  bool isOpen() const { return fd_ >= 0; }
  /// False (errno says why) if the system reports a late write error.
  bool close() {
    const int fd = fd_;
    fd_ = -1;
    return ::close(fd) == 0;
  }

 private:
  int fd_;
};

/// 0 or errno.
int writeAll(File& file, const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(file.get(), bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    done += static_cast<std::size_t>(written);
  }
  if (::fsync(file.get()) != 0 || !file.close()) return errno;
  return 0;
}

std::string temporaryNeighbour(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  return path + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
}

}  // namespace

std::vector<std::uint8_t> readFile(const std::string& path, std::size_t max_bytes) {
  File file(path, O_RDONLY | O_NONBLOCK);  // a named pipe must not block
  if (!file.isOpen()) fail("open", path, errno);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) fail("read", path, errno);
  if (!S_ISREG(status.st_mode)) {
    throw std::runtime_error("cannot read '" + path + "': got a folder or device, wanted a file");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > max_bytes) {
    throw std::runtime_error("cannot read '" + path + "': got " + std::to_string(size) +
                             " bytes, wanted at most " + std::to_string(max_bytes));
  }
  std::vector<std::uint8_t> bytes(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = ::read(file.get(), bytes.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read", path, errno);
    if (got == 0) break;  // somebody truncated it meanwhile: the checksums will tell
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

void writeFileAtomically(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  const std::string temporary = temporaryNeighbour(path);
  File file(temporary, O_WRONLY | O_CREAT | O_EXCL, 0666);
  if (!file.isOpen()) fail("write", path, errno);
  int error = writeAll(file, bytes);
  if (error == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    fail("write", path, error);
  }
}

TtSdfMap loadMap(const std::string& path, const MapLimits& limits) {
  const std::vector<std::uint8_t> bytes = readFile(path);
  try {
    return deserialize(bytes.data(), bytes.size(), limits);
  } catch (const MapFormatError& error) {
    throw MapFormatError("'" + path + "': " + error.what());
  }
}

}  // namespace ttsdf
