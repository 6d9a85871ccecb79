#pragma once
// Who runs the tasks of a build: processes of this machine, a Dask scheduler, or whoever reads a file of
// commands.

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace ttsdf {

struct WorkerTask {
  std::string name;
  std::string command;  ///< for a shell
  std::string log;      ///< file that what it prints goes to
};

/// The text as one word of a shell's command.
std::string shellWord(const std::string& text);

/// Gives the next task; nothing: there is none left.
using NextTask = std::function<std::optional<WorkerTask>()>;
/// Called after each task that ended well.
using TaskDone = std::function<void(const WorkerTask& task)>;

/// Runs up to `workers` tasks at a time, each in a process of its own. One whose process dies (a signal) is
/// tried again, three times in all. Throws std::runtime_error with what the
/// first task that failed printed last; those that run are waited for.
void runInProcesses(int workers, const NextTask& next, const TaskDone& done);

/// Runs the tasks through the Dask scheduler at `address`, whose workers see the same files. `list`: a file
/// that the tasks are written to. Throws std::runtime_error.
void runThroughDask(const std::string& address, const std::vector<WorkerTask>& tasks, const std::string& list,
                    const TaskDone& done);

/// Writes the commands to a file, one a line; a makefile if it is called Makefile or *.mk, whose last rule is
/// `finish`.
void writeCommands(const std::vector<WorkerTask>& tasks, const std::string& finish, const std::string& path);

}  // namespace ttsdf
