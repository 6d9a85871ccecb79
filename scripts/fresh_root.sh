# shellcheck shell=bash
# The part of scripts/fresh that runs in namespaces of its own: makes the root, enters it, runs the command.
# Run by scripts/fresh only, which passes TTSDF_FRESH_ROOT, _CACHE, _RELEASE, _ARCH, _WITH and _CCACHE.

set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

readonly MIRROR=${TTSDF_DEBIAN_MIRROR:-http://deb.debian.org/debian} SECURITY=http://deb.debian.org/debian-security
readonly CACHE_DAYS=14 NO_ROOT=125 COPY=/root/ttsdf_localization
root=$TTSDF_FRESH_ROOT release=$TTSDF_FRESH_RELEASE arch=$TTSDF_FRESH_ARCH
base="$TTSDF_FRESH_CACHE/$release-$arch.tar.gz" archives="$TTSDF_FRESH_CACHE/archives/$release-$arch"

say() { printf '\033[1m[fresh]\033[0m %s\n' "$*" >&2; }
no_root() { printf '[fresh] error: %s\n' "$*" >&2; exit $NO_ROOT; }

# The minimal system, from the network, and a copy of it for the next time.
bootstrap() {
  local log="$root.log"
  say "making a minimal $release ($arch) with debootstrap"
  mkdir -p "$archives"
  if ! debootstrap --variant=minbase --arch="$arch" --cache-dir="$archives" "$release" "$root" "$MIRROR" >"$log" 2>&1; then
    local reason
    reason=$(grep -E '^(E|W): ' "$log" | tail -1 || true)
    if [ "$(df --output=avail --block-size=1M "$root" | tail -1)" -lt 100 ]; then reason="the disk is full"; fi
    rm -f "$log"
    no_root "debootstrap could not make $release ($arch) from $MIRROR: ${reason:-no reason given}"
  fi
  rm -f "$log"
  rm -f "$root"/var/cache/apt/archives/*.deb "$base".new.*
  if GZIP=-1 tar --create --gzip --one-file-system --file "$base.new.$$" --directory "$root" . 2>/dev/null; then
    mv "$base.new.$$" "$base"
  else
    rm -f "$base.new.$$"
    say "warning: the minimal system could not be kept in $TTSDF_FRESH_CACHE (no space?)"
  fi
}

make_system() {
  if [ -e "$root/etc/ttsdf_fresh" ]; then
    say "using the root in $root again"
    return
  fi
  if [ -n "$(ls -A "$root")" ]; then no_root "$root: got a folder with other things in it, wanted an empty one or an older root"; fi
  if [ -e "$base" ] && [ -n "$(find "$base" -mtime +$CACHE_DAYS)" ]; then
    say "the minimal system in the cache is older than $CACHE_DAYS days: made anew"
    rm -f "$base"
  fi
  if [ -e "$base" ]; then
    say "unpacking a minimal $release ($arch) from the cache, of $(date -r "$base" '+%Y-%m-%d %H:%M')"
    if ! tar --extract --gzip --file "$base" --directory "$root" 2>/dev/null; then
      say "the minimal system in the cache is damaged: made anew"
      rm -f "$base"
      find "$root" -mindepth 1 -delete
      bootstrap
    fi
  else
    bootstrap
  fi
}

# What an installed machine has beyond the packages: its names, its package sources, and this machine's way to them.
configure_system() {
  local name="fresh-$release"
  cp --dereference /etc/resolv.conf "$root/etc/resolv.conf"
  printf '%s\n' "$name" | tee "$root/etc/hostname" >/proc/sys/kernel/hostname
  printf '127.0.0.1 localhost\n127.0.1.1 %s\n::1 localhost ip6-localhost ip6-loopback\n' "$name" >"$root/etc/hosts"
  printf 'deb %s\n' "$MIRROR $release main" "$MIRROR $release-updates main" >"$root/etc/apt/sources.list"
  # Security support of bullseye has ended: its index is still served, the packages no longer.
  if [ "$release" != bullseye ]; then
    printf 'deb %s\n' "$SECURITY $release-security main" >>"$root/etc/apt/sources.list"
  fi
  apt-config dump | grep -E '^Acquire::(http|https|Retries|Check-)' >"$root/etc/apt/apt.conf.d/90machine" || true
  echo 'Binary::apt-get::APT::Keep-Downloaded-Packages "true";' >"$root/etc/apt/apt.conf.d/91keep"
  echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/fresh"  # nobody needs this system after a power cut
  printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"  # no services
  chmod 755 "$root/usr/sbin/policy-rc.d"
  : >"$root/etc/ttsdf_fresh"
}

# Made in this mount namespace only: they go with it.
mount_system() {
  mount -t proc proc "$root/proc"
  mount -t sysfs -o ro sysfs "$root/sys"
  mount -t devpts -o newinstance,ptmxmode=0666,mode=620 devpts "$root/dev/pts"
  mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
  # One run at a time has the cache of packages: apt locks it.
  mkdir -p "$archives"
  exec 8>"$archives.lock"
  if flock --nonblock 8; then
    mount --bind "$archives" "$root/var/cache/apt/archives"
  else
    say "another run uses the cache of packages: downloading them again"
  fi
  if [ -n "${TTSDF_TEST_DATA:-}" ]; then
    mkdir -p "$root/mnt/test_data"
    mount --bind -o ro "$TTSDF_TEST_DATA" "$root/mnt/test_data"
  fi
  if [ -n "$TTSDF_FRESH_CCACHE" ]; then
    mkdir -p "$TTSDF_FRESH_CCACHE" "$root/mnt/ccache"
    mount --bind "$TTSDF_FRESH_CCACHE" "$root/mnt/ccache"
  fi
}

# The files of the checkout; those that git ignores (build folders) stay out. A build of an earlier command stays, and takes
# all files for new ones.
copy_checkout() {
  mkdir -p "$root$COPY"
  find "$root$COPY" -mindepth 1 -maxdepth 1 ! -name build -exec rm -rf {} +
  if [ -n "$TTSDF_FRESH_WITH" ]; then
    cp -R "$TTSDF_FRESH_WITH/." "$root$COPY"
  elif git -C "$TTSDF_ROOT" -c safe.directory='*' rev-parse --git-dir >/dev/null 2>&1; then
    git -C "$TTSDF_ROOT" -c safe.directory='*' ls-files -z --cached --others --exclude-standard |
      (cd "$TTSDF_ROOT" && xargs -0 sh -c 'for f; do [ ! -e "$f" ] || printf "%s\0" "$f"; done' sh) |
      tar --create --directory "$TTSDF_ROOT" --null --files-from=- | tar --extract --touch --directory "$root$COPY" --no-same-owner
  else
    tar --create --directory "$TTSDF_ROOT" --exclude=./build . | tar --extract --touch --directory "$root$COPY" --no-same-owner
  fi
}

make_system
configure_system
mount_system
copy_checkout
variables=(HOME=/root USER=root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
  LANG=C.UTF-8 TERM="${TERM:-dumb}" DEBIAN_FRONTEND=noninteractive)
for name in CI http_proxy https_proxy no_proxy; do
  if [ -n "${!name:-}" ]; then variables+=("$name=${!name}"); fi
done
if [ -n "${TTSDF_TEST_DATA:-}" ]; then variables+=(TTSDF_TEST_DATA=/mnt/test_data); fi
if [ -n "$TTSDF_FRESH_CCACHE" ]; then
  say "compilations are taken from $TTSDF_FRESH_CCACHE where they are there: the minutes are not those of a new machine"
  chroot "$root" env "${variables[@]}" sh -c 'apt-get -q update && apt-get -qy install --no-install-recommends ccache' \
    >/dev/null 2>&1 || no_root "ccache could not be installed in the root (no network?)"
  variables+=(CCACHE_DIR=/mnt/ccache CCACHE_BASEDIR="$COPY" CCACHE_NOHASHDIR=1 CCACHE_MAXSIZE=20G)
fi

say "running in a fresh $release ($arch): $*"
code=0
seconds=$SECONDS
# Not exec: this shell is process 1 of the namespace and collects orphans; the command's last processes end with it.
env -i "${variables[@]}" chroot "$root" sh -c 'cd "$0" && exec "$@"' "$COPY" "$@" || code=$?
say "$(((SECONDS - seconds) / 60)) min $(((SECONDS - seconds) % 60)) s in a fresh $release ($arch), exit code $code"
exit $code
