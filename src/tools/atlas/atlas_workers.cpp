#include "atlas_workers.h"

#include <fcntl.h>
#include <json/value.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>

#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {

namespace {

namespace fs = std::filesystem;
constexpr int kAttempts = 3;
constexpr int kNotRun = 126;  // from this exit code on a shell says that the command did not end by itself
constexpr int kNoSuchCommand = 127;
constexpr int kSignal = 128;  // and the signal's number: what a shell says of a command that a signal ended
constexpr const char* kDaskScript = "atlas_dask";

/// A shell that waits for the command "$1", any words of a shell, and takes all that it started along when it
/// is told to go. It says nothing itself ("Killed"): the log's last line is the command's.
constexpr const char* kShell =
    "trap 'trap \"\" TERM; kill -TERM 0; exit 143' TERM INT HUP; exec 3>&2 2>/dev/null; "
    "/bin/sh -c \"$1\" 2>&3 3>&- & wait $!";

/// Starts a task's command in a process group of its own. The group goes when this process does.
pid_t start(const WorkerTask& task) {
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("cannot start a worker: " + std::string(std::strerror(errno)));
  if (child > 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent || ::setpgid(0, 0) != 0) ::_exit(1);
  const int out = ::open(task.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644),
            in = ::open("/dev/null", O_RDONLY);
  if (out < 0 || in < 0) ::_exit(kNotRun);
  ::dup2(in, STDIN_FILENO), ::dup2(out, STDOUT_FILENO), ::dup2(out, STDERR_FILENO);
  ::execl("/bin/sh", "sh", "-c", kShell, "sh", task.command.c_str(), nullptr);
  ::_exit(kNotRun);
}

/// The signal that ended a command, also one that a shell tells of; 0: none.
int signalOf(int status) {
  if (WIFSIGNALED(status)) return WTERMSIG(status);
  const int code = WEXITSTATUS(status);
  return code > kSignal && code <= kSignal + SIGRTMAX ? code - kSignal : 0;
}

/// What a task printed last. A shell's word for the signal ("Killed") is none of it.
std::string lastLineOf(const std::string& path, int status) {
  const int signal = signalOf(status);
  const std::string word = signal != 0 ? ::strsignal(signal) : "";
  std::ifstream file(path);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line != word) last = line;
  }
  return last;
}

std::string fateOf(int status) {
  if (const int signal = signalOf(status)) return "signal " + std::to_string(signal);
  const int code = WEXITSTATUS(status);
  return "exit code " + std::to_string(code) + (code == kNoSuchCommand ? " (no such command)" : "");
}

bool died(int status) {
  return WIFSIGNALED(status) || (WEXITSTATUS(status) >= kNotRun && WEXITSTATUS(status) != kNoSuchCommand);
}

std::string scriptPath() {
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& folder : {here, fs::path(TTSDF_SCRIPTS_DIR)}) {
    if (fs::exists(folder / kDaskScript)) return (folder / kDaskScript).string();
  }
  throw std::runtime_error("got no script '" + std::string(kDaskScript) +
                           "' beside this program, wanted it in '" + here.string() + "' or '" +
                           TTSDF_SCRIPTS_DIR + "'");
}

bool isMakefile(const std::string& path) {
  return fs::path(path).filename() == "Makefile" || fs::path(path).extension() == ".mk";
}

std::string forMake(const std::string& command) {
  std::string text;
  for (const char c : command) text += c == '$' ? std::string("$$") : std::string(1, c);
  return text;
}

}  // namespace

std::string shellWord(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

void runInProcesses(int workers, const NextTask& next, const TaskDone& done) {
  struct Running {
    WorkerTask task;
    int attempt;
  };
  ::signal(SIGCHLD, SIG_DFL);  // ignored, as some starters leave it, no child could be waited for
  std::map<pid_t, Running> running;
  std::string failure;
  bool more = true;
  while (true) {
    while (more && failure.empty() && running.size() < static_cast<std::size_t>(workers)) {
      try {
        const auto task = next();
        more = task.has_value();
        if (task) running[start(*task)] = {*task, 1};
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }
    if (running.empty()) break;
    int status = 0;
    const pid_t child = ::waitpid(-1, &status, 0);
    if (child < 0 && errno == EINTR) continue;
    if (child < 0)
      throw std::runtime_error("cannot wait for the workers: " + std::string(std::strerror(errno)));
    const auto found = running.find(child);
    if (found == running.end()) continue;
    const Running ended = found->second;
    running.erase(found);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
      done(ended.task);
    } else if (died(status) && ended.attempt < kAttempts && failure.empty()) {
      running[start(ended.task)] = {ended.task, ended.attempt + 1};
    } else if (failure.empty()) {
      failure = "cell '" + ended.task.name + "': its worker ended with " + fateOf(status) +
                (died(status) ? ", " + std::to_string(ended.attempt) + " times" : std::string()) + ": " +
                lastLineOf(ended.task.log, status) + " (the same command goes on where it stopped)";
    }
  }
  if (!failure.empty()) throw std::runtime_error(failure);
}

void runThroughDask(const std::string& address, const std::vector<WorkerTask>& tasks, const std::string& list,
                    const TaskDone& done) {
  if (tasks.empty()) return;
  Json::Value root(Json::arrayValue);
  std::map<std::string, const WorkerTask*> by_name;
  for (const WorkerTask& task : tasks) {
    Json::Value entry;
    entry["name"] = task.name;
    entry["command"] = task.command;
    root.append(entry);
    by_name[task.name] = &task;
  }
  writeJson(list, root);
  const std::string command = shellWord(scriptPath()) + " " + shellWord(address) + " " + shellWord(list);
  std::FILE* const pipe = ::popen(command.c_str(), "r");
  if (!pipe) throw std::runtime_error("cannot run '" + command + "': " + std::strerror(errno));
  std::string failure;
  char line[4096];
  while (std::fgets(line, sizeof line, pipe)) {
    std::string text(line);
    while (!text.empty() && text.back() == '\n') text.pop_back();
    if (text.rfind("done ", 0) == 0) {
      const auto found = by_name.find(text.substr(5));
      if (found != by_name.end()) done(*found->second);
    } else if (failure.empty() && text.rfind("failed ", 0) == 0) {
      failure = text.substr(7);
    }
  }
  const int status = ::pclose(pipe);
  if (status == 0) return;
  throw std::runtime_error("scheduler '" + address + "': " +
                           (failure.empty() ? "the tasks were not run (" + fateOf(status) + ")" : failure));
}

void writeCommands(const std::vector<WorkerTask>& tasks, const std::string& finish, const std::string& path) {
  OutputFile file(path);
  if (isMakefile(path)) {
    file.stream() << ".PHONY: finish";
    for (const WorkerTask& task : tasks) file.stream() << ' ' << task.name;
    file.stream() << "\nfinish:";
    for (const WorkerTask& task : tasks) file.stream() << ' ' << task.name;
    file.stream() << "\n\t" << forMake(finish) << '\n';
    for (const WorkerTask& task : tasks)
      file.stream() << task.name << ":\n\t" << forMake(task.command) << '\n';
  } else {
    for (const WorkerTask& task : tasks) file.stream() << task.command << '\n';
  }
  file.close();
}

}  // namespace ttsdf
