#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# install.sh ARCH PACKAGES: installs the packages of a folder with dpkg into a fresh Debian of that architecture and tries them there:
# --version, doctor, a replay that gives the same bits as this computer's, its judgement by the tools, upgrade, removal, purge. Says what they add to a
# minimal Debian. Root (a user namespace of its own with all users; other architectures' programs are told to the kernel in it
# alone, Linux 6.7). The root is kept as .cache/roots/ARCH.tar and not made anew.
set -euo pipefail
arch=$1
packages=$(readlink -f "$2")
here=$(dirname "$(readlink -f "$0")")
cd "$here/../.."
mkdir -p .cache/roots
roots=$(readlink -f .cache/roots)
say() { printf '\033[1m== %s\033[0m\n' "$*"; }
fail() { echo "install.sh $arch: $*" >&2; exit 1; }

# In a user namespace of its own, where this architecture's programs run.
[ "${WM_OWN_USERS:-}" = 1 ] || exec bash toolchain/foreign.sh "$arch" bash "$here/install.sh" "$arch" "$packages"

# ── a fresh root, with what the packages depend on and nothing else ──────────────────────────────────────────────────
runtime=$(ls "$packages"/waymark_*_"$arch".deb)
depends=$(dpkg-deb -f "$runtime" Depends | sed 's/ *([^)]*)//g; s/, */,/g')
if [ ! -e "$roots/$arch.tar" ] || [ "$(cat "$roots/$arch.depends" 2>/dev/null)" != "$depends" ]; then
  say "a minimal Debian, $arch"
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep -v security | head -1)
  apt-config dump | grep -E '^Acquire::(https?|Retries)' | grep -v '""' >"$roots/$arch.apt.conf" || true # a proxy, retries
  # Inside of the root by its own apt: this machine's packages are not touched.
  # The security suite is left out: a mirror's index of it is sometimes in the middle of a change.
  mmdebstrap --mode=root --variant=minbase --architectures="$arch" \
    --customize-hook='dpkg-query --admindir="$1/var/lib/dpkg" -W -f="\${Installed-Size}\n" >"'"$roots/$arch.before"'"' \
    --customize-hook="cp '$roots/$arch.apt.conf' \"\$1/etc/apt/apt.conf.d/99desk\"" \
    --customize-hook="chroot \"\$1\" apt-get -q install -y --no-install-recommends ${depends//,/ }" \
    --customize-hook='dpkg-query --admindir="$1/var/lib/dpkg" -W -f="\${Installed-Size}\n" >"'"$roots/$arch.after"'"' \
    bookworm "$roots/$arch.new.tar" "deb $mirror bookworm main" "deb $mirror bookworm-updates main" >"$roots/$arch.log" 2>&1 ||
    { tail -30 "$roots/$arch.log" >&2; fail "no root (above)"; }
  mv "$roots/$arch.new.tar" "$roots/$arch.tar"
  echo "$depends" >"$roots/$arch.depends"
fi
root=$(mktemp -d "$roots/$arch.XXXXXX")
# Never into what is mounted there.
trap 'umount -R "$root/proc" "$root"/dev/* 2>/dev/null || true; rm -rf --one-file-system "$root"' EXIT
tar -C "$root" -xf "$roots/$arch.tar" --exclude='./dev/*'
mkdir -p "$root/dev" "$root/proc" "$root/trial"
for device in null zero random urandom; do : >"$root/dev/$device"; mount --bind "/dev/$device" "$root/dev/$device"; done
mount --rbind /proc "$root/proc"
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"; }

# ── install, run ─────────────────────────────────────────────────────────────────────────────────────────────────────
cp "$runtime" "$root/trial/waymark.deb"
say "dpkg -i $(basename "$runtime")"
inside dpkg -i /trial/waymark.deb
python3 tests/package/hardening.py "$root/usr/bin/waymark" || fail "hardening"
inside waymark --version
echo "machine: $(inside uname -m)"
inside waymark doctor --seconds 1 || [ $? -eq 1 ] || fail "doctor"

say "replays"
rm -rf "$roots/$arch.recordings"
mkdir -p "$roots/$arch.recordings"
build/bin/waymark simulate config/worlds/crossing.yaml --no-video --out "$roots/$arch.recordings/crossing" >/dev/null 2>&1 ||
  build/bin/waymark simulate config/worlds/crossing.yaml --out "$roots/$arch.recordings/crossing" >/dev/null
cp -r "$roots/$arch.recordings/crossing" "$root/trial/crossing"
inside waymark replay /trial/crossing --config /usr/share/doc/waymark/examples/datasets/crossing-points.yaml --out /trial/run | tail -3
build/bin/waymark replay "$roots/$arch.recordings/crossing" --config "$root/usr/share/doc/waymark/examples/datasets/crossing-points.yaml" --out "$roots/$arch.recordings/run" >/dev/null
cmp "$root/trial/run/trajectory.csv" "$roots/$arch.recordings/run/trajectory.csv" || fail "its trajectory is not this computer's"
echo "the same $(wc -c <"$root/trial/run/trajectory.csv") bytes of trajectory as on this computer"

say "the tools"
cp "$packages"/waymark-tools_*_"$arch".deb "$root/trial/waymark-tools.deb"
inside dpkg -i /trial/waymark-tools.deb >/dev/null
inside waymark eval /trial/run /trial/crossing --json >"$roots/$arch.recordings/judged.json"
build/bin/waymark eval "$roots/$arch.recordings/run" "$roots/$arch.recordings/crossing" --json >"$roots/$arch.recordings/judged-here.json"
cmp "$roots/$arch.recordings/judged.json" "$roots/$arch.recordings/judged-here.json" || fail "its judge says something else than this computer's"
inside waymark report /trial/run /trial/crossing --out /trial/report.html >/dev/null
inside waymark diff /trial/run /trial/run >/dev/null
inside dpkg -P waymark-tools >/dev/null
echo "eval says the same as on this computer, report and diff run; removed again"

# ── what is kept, what goes ──────────────────────────────────────────────────────────────────────────────────────────
say "upgrade, removal, purge"
echo "# mine" >>"$root/etc/waymark/robot.yaml"
echo "pose" >"$root/var/lib/waymark/pose.yaml"
inside dpkg -i /trial/waymark.deb >/dev/null
tail -1 "$root/etc/waymark/robot.yaml" | grep -qx '# mine' || fail "the upgrade took the configuration"
[ -e "$root/var/lib/waymark/pose.yaml" ] || fail "the upgrade took the saved pose"
inside dpkg -r waymark >/dev/null
{ [ -e "$root/etc/waymark/robot.yaml" ] && [ -e "$root/var/lib/waymark/pose.yaml" ]; } || fail "removal took the configuration or the pose"
[ ! -e "$root/usr/bin/waymark" ] || fail "removal left the program"
inside dpkg -P waymark >/dev/null
{ [ ! -e "$root/etc/waymark" ] && [ ! -e "$root/var/lib/waymark" ]; } || fail "purge left something: $(ls -d "$root"/etc/waymark/* "$root"/var/lib/waymark*)"
echo "configuration and pose are kept by upgrade and removal, and gone after a purge"

sum() { awk '{kib += $1} END {print kib}' "$1"; }
own=$(dpkg-deb -f "$runtime" Installed-Size)
added=$(($(sum "$roots/$arch.after") - $(sum "$roots/$arch.before")))
say "$(($(wc -l <"$roots/$arch.after") - $(wc -l <"$roots/$arch.before") + 1)) packages beyond a minimal Debian: $added KiB of libraries, $own KiB waymark"
[ $((added + own)) -le $((40 * 1000 * 1000 / 1024)) ] || fail "more than 40 MB"
