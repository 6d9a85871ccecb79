# shellcheck shell=bash
# Helpers of the scripts in this folder. Sourced, never run; the caller has set -euo pipefail.

TTSDF_ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
TTSDF_BUILD_DIR="${TTSDF_BUILD_DIR:-$TTSDF_ROOT/build}"

# ROS and catkin of Debian need Debian's Python: a pyenv or conda interpreter earlier in PATH would not see them.
export PATH="/usr/bin:/bin:/usr/sbin:/sbin:$PATH"
unset PYTHONHOME PYTHONPATH
export PYTHONUNBUFFERED=1

say() { printf '\033[1m[%s]\033[0m %s\n' "$(basename "$0")" "$*" >&2; }
die() { printf '[%s] error: %s\n' "$(basename "$0")" "$*" >&2; exit 1; }
# Wrong usage: the sentence, then where the help is.
misuse() { printf '[%s] error: %s (see --help)\n' "$(basename "$0")" "$*" >&2; exit 2; }

# The comment block at the top of a script is its help text.
show_help() { sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"; }

# Runs a command as root: directly, or through sudo.
as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    die "root is needed to run: $* (no sudo here; run it as root yourself)"
  fi
}

# Memory this process may still take [MB]: the machine's, or the container's limit if that is lower.
available_megabytes() {
  local machine limit used
  machine=$(awk '/^MemAvailable/ {print int($2 / 1024)}' /proc/meminfo)
  limit=$(cat /sys/fs/cgroup/memory.max 2>/dev/null || echo max)
  used=$(cat /sys/fs/cgroup/memory.current 2>/dev/null || echo 0)
  if [ "$limit" != max ] && [ $(((limit - used) / 1048576)) -lt "$machine" ]; then
    machine=$(((limit - used) / 1048576))
  fi
  echo "$machine"
}

# Parallel compilations: one per core, but 1.5 GB each (a file that includes PCL or OpenVDB takes that much).
build_jobs() {
  local cores by_memory
  cores=$(nproc)
  by_memory=$(($(available_megabytes) / 1500))
  if [ "$by_memory" -lt 1 ]; then by_memory=1; fi
  echo $((cores < by_memory ? cores : by_memory))
}

# A TCP port nobody listens on, below those that the system gives to outgoing connections: who asks for a master that is
# not up yet could be given its port, and be connected to himself.
free_port() {
  /usr/bin/python3 - <<'PYTHON'
import random, socket
for port in random.sample(range(12000, 30000), 1000):
    try:
        with socket.socket() as s:
            s.bind(("", port))
    except OSError:
        continue
    print(port)
    break
PYTHON
}

# The environment of the development space that scripts/build made.
source_devel_space() {
  local setup="$TTSDF_BUILD_DIR/devel/setup.bash"
  [ -f "$setup" ] || die "no $setup: run scripts/build first"
  set +u
  # shellcheck disable=SC1090
  . "$setup"
  set -u
}

# A ROS world of its own: own master port, own logs. Nothing here meets another roscore on this machine.
use_private_ros() {
  ROS_MASTER_PORT=$(free_port)
  export ROS_MASTER_URI="http://localhost:$ROS_MASTER_PORT"
  export ROS_HOSTNAME=localhost
  unset ROS_IP
  ROS_HOME=$(mktemp -d "${TMPDIR:-/tmp}/ttsdf_ros.XXXXXX")
  export ROS_HOME ROS_LOG_DIR="$ROS_HOME/log"
}
