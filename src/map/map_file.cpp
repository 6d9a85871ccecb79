// Map files on disk.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

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
  File(const std::string& path, int flags) : fd_(::open(path.c_str(), flags | O_CLOEXEC)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return fd_; }
  bool isOpen() const { return fd_ >= 0; }

 private:
  int fd_;
};

}  // namespace

const FileKind kMapFile{"a map", {'T', 'T', 'S', 'D', 'F', '\r', '\n', '\x1A'}};

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

TtSdfMap loadMap(const std::string& path, const MapLimits& limits) {
  const std::vector<std::uint8_t> bytes = readFile(path);
  try {
    return deserialize(bytes.data(), bytes.size(), limits);
  } catch (const MapFormatError& error) {
    throw MapFormatError("'" + path + "': " + error.what());
  }
}

}  // namespace ttsdf
