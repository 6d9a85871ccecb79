#include "ttsdf_localization/files/file_writer.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace ttsdf {

namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;          // as the kernel
constexpr std::size_t kMaxStem = 200;  // of 255 bytes that a name may have
constexpr char kMark[] = ".tmp-";      // between the target's name and six characters of mkostemp
constexpr std::size_t kRandomCharacters = 6;

[[noreturn]] void refusePath(const std::string& path, const std::string& what) {
  throw std::runtime_error("cannot write '" + path + "': " + what);
}

const char* fileTypeName(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "no regular file";
}

/// Where the links of `path` end; the end itself need not exist.
std::string withoutLinks(const std::string& path) {
  fs::path target = path;
  for (int links = 0; fs::is_symlink(fs::symlink_status(target)); ++links) {
    if (links == kMaxLinks) refusePath(path, "too many links");
    const fs::path next = fs::read_symlink(target);
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target.string();
}

std::string folderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

/// What every temporary of this target begins with, without the folder.
std::string temporaryStem(const std::string& target) {
  return fs::path(target).filename().string().substr(0, kMaxStem) + kMark;
}

/// The old file may be replaced: it is a regular one, of the same kind or empty.
void checkOldFile(const std::string& path, const std::string& target, const FileKind& kind) {
  struct stat status {};
  if (::stat(target.c_str(), &status) != 0) {
    if (errno != ENOENT) refusePath(path, std::strerror(errno));
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    refusePath(path,
               std::string("got ") + fileTypeName(status.st_mode) + ", wanted nothing or a regular file");
  }
  if (::access(target.c_str(), W_OK) != 0) refusePath(path, std::strerror(errno));
  if (kind.magic.empty() || status.st_size == 0) return;
  std::string begin(kind.magic.size(), '\0');
  std::ifstream old(target, std::ios::binary);
  if (!old.read(begin.data(), static_cast<std::streamsize>(begin.size())) || begin != kind.magic) {
    refusePath(path, "got a file that is not " + kind.name +
                         ", and only that is replaced; remove it, or give another name");
  }
}

/// A writer holds a lock on its temporary for as long as it lives; one without a lock was left by a killed
/// one.
void removeLeftovers(const std::string& folder, const std::string& stem) {
  DIR* const entries = ::opendir(folder.c_str());
  if (!entries) return;
  std::vector<std::string> left;
  while (const dirent* entry = ::readdir(entries)) {
    const std::string name = entry->d_name;
    if (name.size() == stem.size() + kRandomCharacters && name.compare(0, stem.size(), stem) == 0)
      left.push_back(folder + '/' + name);
  }
  ::closedir(entries);
  for (const std::string& file : left) {
    const int fd = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    struct stat status {};
    if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && ::flock(fd, LOCK_EX | LOCK_NB) == 0)
      ::unlink(file.c_str());
    ::close(fd);
  }
}

/// Owner and mode of the file that will be replaced, or what a new file gets here.
void adoptOwnerAndMode(int fd, const std::string& target) {
  struct stat old {};
  if (::stat(target.c_str(), &old) == 0) {
    struct stat own {};
    const bool other = ::fstat(fd, &own) == 0 && (own.st_uid != old.st_uid || own.st_gid != old.st_gid);
    // Only root may give a file away; the group at least may be one of ours.
    if (other && ::fchown(fd, old.st_uid, old.st_gid) != 0 &&
        ::fchown(fd, static_cast<uid_t>(-1), old.st_gid) != 0) {
      errno = 0;
    }
    ::fchmod(fd, old.st_mode & 07777);  // after fchown, which takes away set-user-id
    return;
  }
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(fd, 0666 & ~mask);
}

/// 0 or errno. Some file systems cannot sync a folder, and say so.
int syncFolder(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return errno == EACCES ? 0 : errno;  // a folder that may be written, not read
  const int error = ::fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
  ::close(fd);
  return error;
}

}  // namespace

FileWriter::FileWriter(std::string path, const FileKind& kind) : path_(std::move(path)) {
  if (path_.empty()) throw std::runtime_error("cannot write '': got no file name");
  target_ = withoutLinks(path_);
  checkOldFile(path_, target_, kind);
  makeTemporary();
}

void FileWriter::makeTemporary() {
  const std::string folder = folderOf(target_), stem = temporaryStem(target_);
  removeLeftovers(folder, stem);
  // Another writer may take it for a leftover before it is locked: then once more.
  for (int attempt = 0; attempt < 100; ++attempt) {
    temporary_ = folder + '/' + stem + std::string(kRandomCharacters, 'X');
    fd_ = ::mkostemp(temporary_.data(), O_CLOEXEC);
    if (fd_ < 0) fail(errno);
    struct stat status {};
    ::flock(fd_, LOCK_EX | LOCK_NB);  // a file system without locks: nothing is taken for a leftover either
    if (::fstat(fd_, &status) == 0 && status.st_nlink > 0) {
      adoptOwnerAndMode(fd_, target_);
      return;
    }
    ::close(std::exchange(fd_, -1));
  }
  refusePath(path_, "its temporary goes away as soon as it is made");
}

FileWriter::~FileWriter() {
  if (fd_ < 0) return;
  ::unlink(temporary_.c_str());
  ::close(fd_);
}

void FileWriter::fail(int error) const { refusePath(path_, std::strerror(error)); }

void FileWriter::commit(const std::function<void()>& check) {
  if (::fsync(fd_) != 0) fail(errno);
  if (check) {
    ::posix_fadvise(fd_, 0, 0, POSIX_FADV_DONTNEED);  // so that the disk is asked, not the memory before it
    check();
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
  if (::close(std::exchange(fd_, -1)) != 0) fail(errno);
  if (const int error = syncFolder(folderOf(target_))) fail(error);
}

OutputFile::OutputFile(const std::string& path) {
  if (path.empty()) return;
  writer_ = std::make_unique<FileWriter>(path);
  stream_.open(writer_->temporary());
}

OutputFile::~OutputFile() = default;

void OutputFile::close() {
  if (!writer_) return;
  stream_.close();
  if (!stream_) refusePath(writer_->temporary(), "a write failed; is the disk full?");
  writer_->commit();
  writer_.reset();
}

void writeFileAtomically(const std::string& path, const void* bytes, std::size_t size, const FileKind& kind) {
  const char* const begin = static_cast<const char*>(bytes);
  FileWriter writer(path, kind);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t written = ::write(writer.descriptor(), begin + done, size - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) refusePath(path, std::strerror(errno));
    done += static_cast<std::size_t>(written);
  }
  writer.commit([&] {
    std::vector<std::uint8_t> block(std::size_t{1} << 16);
    for (std::size_t at = 0; at <= size;) {
      const ssize_t got = ::pread(writer.descriptor(), block.data(), block.size(), static_cast<off_t>(at));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) refusePath(path, std::string("reading it back: ") + std::strerror(errno));
      const auto n = static_cast<std::size_t>(got);
      if (n == 0 && at == size) return;
      if (n == 0 || at + n > size || std::memcmp(block.data(), begin + at, n) != 0) break;
      at += n;
    }
    refusePath(path, "what was read back is not what was written");
  });
}

void writeFileAtomically(const std::string& path, const std::vector<std::uint8_t>& bytes,
                         const FileKind& kind) {
  writeFileAtomically(path, bytes.data(), bytes.size(), kind);
}

void requireWritable(const std::string& path, const FileKind& kind) { const FileWriter writer(path, kind); }

std::string targetOf(const std::string& path) {
  std::error_code error;
  const std::string end = withoutLinks(path);
  const fs::path target = fs::weakly_canonical(fs::absolute(end), error);
  if (error) refusePath(path, error.message());
  return target.string();
}

std::string pathInFolder(const std::string& what, const std::string& path, const std::string& folder) {
  const auto bad = [&](const std::string& wanted) {
    return std::invalid_argument(what + ": got '" + path + "', wanted " + wanted);
  };
  const fs::path asked(path);
  if (!asked.is_absolute()) throw bad("an absolute path (a node runs in a folder of its own)");
  if (folder.empty()) return path;
  if (std::find(asked.begin(), asked.end(), "..") != asked.end()) throw bad("a path without '..'");
  std::error_code error;
  const fs::path home = fs::weakly_canonical(folder, error);
  const fs::path target = error ? fs::path() : fs::weakly_canonical(withoutLinks(path), error);
  const auto ends = std::mismatch(home.begin(), home.end(), target.begin(), target.end());
  if (error || ends.first != home.end() || ends.second == target.end())
    throw bad("a file in the map folder '" + folder + "'");
  return target.string();
}

}  // namespace ttsdf
