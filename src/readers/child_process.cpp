#include "ttsdf_localization/readers/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>

namespace ttsdf {

namespace {

constexpr double kWallPerProcessor = 6.0;

// The first byte of what the child sends.
constexpr char kResult = 'R', kError = 'E', kMemory = 'M';

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

void limit(int resource, rlim_t value) {
  rlimit old{};
  if (::getrlimit(static_cast<__rlimit_resource_t>(resource), &old) != 0) return;
  if (old.rlim_max != RLIM_INFINITY && value > old.rlim_max) value = old.rlim_max;
  const rlimit wanted{value, old.rlim_max};
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &wanted);
}

/// Address space that this process has now.
std::size_t addressSpace() {
  std::size_t pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%zu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void sendAll(int fd, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t sent = ::write(fd, bytes, size);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return;
    bytes += sent;
    size -= static_cast<std::size_t>(sent);
  }
}

[[noreturn]] void runChild(int out, [[maybe_unused]] std::size_t space, const ChildLimits& limits,
                           const std::function<std::string()>& work) {
  const int nowhere = ::open("/dev/null", O_RDWR);
  if (nowhere >= 0) {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, fd);
  }
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGTERM, SIGINT, SIGPIPE, SIGXCPU}) {
    ::signal(signal, SIG_DFL);
  }
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<rlim_t>(limits.seconds) + 1);
  limit(RLIMIT_FSIZE, 0);
#if !defined(__SANITIZE_ADDRESS__)
  if (space > 0) limit(RLIMIT_AS, static_cast<rlim_t>(space + limits.memory_bytes));
#endif
  char kind = kResult;
  std::string text;
  try {
    text = work();
  } catch (const std::bad_alloc&) {
    kind = kMemory;
  } catch (const std::length_error&) {
    kind = kMemory;
  } catch (const std::exception& error) {
    kind = kError;
    text = error.what();
  } catch (...) {
    kind = kError;
    text = "unknown error";
  }
  sendAll(out, &kind, 1);
  sendAll(out, text.data(), text.size());
  ::_exit(0);
}

}  // namespace

ChildLimits limitsForFile(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  ChildLimits limits;
  if (error) return limits;
  constexpr double kBytesPerSecond = 2e6;  // of a slow machine
  constexpr std::size_t kSmallFile = std::size_t{1} << 16, kExpansion = 40;
  limits.seconds = 3.0 + static_cast<double>(size) / kBytesPerSecond;
  limits.memory_bytes = (size < kSmallFile ? std::size_t{1} << 26 : std::size_t{1} << 28) + kExpansion * size;
  return limits;
}

std::string runInChild(const std::string& what, const ChildLimits& limits,
                       const std::function<std::string()>& work) {
  using Clock = std::chrono::steady_clock;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw std::runtime_error(what + ": cannot start a process: " + std::strerror(errno));
  Descriptor in(ends[0]), out(ends[1]);
  const std::size_t space = addressSpace();
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(what + ": cannot start a process: " + std::strerror(errno));
  if (child == 0) runChild(out.get(), space, limits, work);
  out.close();

  std::string received;
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(kWallPerProcessor * limits.seconds));
  const char* stopped = nullptr;
  std::string buffer(1 << 16, '\0');
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) stopped = "reading it takes too long";
    if (received.size() > limits.result_bytes) stopped = "it holds too much";
    if (stopped) break;
    pollfd ready{in.get(), POLLIN, 0};
    const int count = ::poll(&ready, 1, static_cast<int>(left));
    if (count < 0 && errno != EINTR) break;
    if (count <= 0) continue;
    const ssize_t got = ::read(in.get(), &buffer[0], buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    received.append(buffer, 0, static_cast<std::size_t>(got));
  }
  if (stopped) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!stopped && WIFSIGNALED(status)) {
    stopped = WTERMSIG(status) == SIGXCPU ? "reading it takes too long" : "reading it crashed";
  } else if (!stopped && (received.empty() || received[0] == kMemory)) {
    stopped = "reading it takes too much memory";
  }
  if (stopped)
    throw std::runtime_error(what + ": the file is damaged or no such file at all (" + stopped + ")");
  const char kind = received[0];
  received.erase(0, 1);
  if (kind == kError) throw std::runtime_error(received);
  return received;
}

}  // namespace ttsdf
