# SPDX-License-Identifier: Apache-2.0
# For the scripts of this folder: packages of stated versions in a temporary folder, and what they print against what was seen.
# Exit status: 0 as seen, 1 it prints something else now, 2 the packages can't be had.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Packages of PyPI, as NAME==VERSION, for $python. Wheels alone: nothing of a package runs when it is installed.
pip_packages() {
  python=$work/venv/bin/python
  python3 -m venv --without-pip "$work/venv" || exit 2
  if command -v uv >/dev/null; then # the same wheels, faster
    uv -q pip install --python "$python" --only-binary :all: "$@" || exit 2
  else
    python3 -m pip -q --disable-pip-version-check --python "$python" install --only-binary :all: "$@" || exit 2
  fi
}

# Packages of Debian 12, as NAME=VERSION, unpacked below $root and not installed.
debian_packages() {
  root=$work/root
  mkdir -p "$root" "$work/deb"
  (cd "$work/deb" && apt-get -qq -o APT::Sandbox::User=root download "$@") || exit 2
  for package in "$work"/deb/*.deb; do dpkg -x "$package" "$root" || exit 2; done
  export LD_LIBRARY_PATH=$root/usr/lib/$(uname -m)-linux-gnu:$root/lib/$(uname -m)-linux-gnu
}

# For drivers of MicroPython: its module, and `bus`, an I2C bus to a chip that is a table of registers. They are found from $work.
micropython_bus() {
  cd "$work"
  echo 'def const(value): return value' >micropython.py
  cat >bus.py <<'EOF'
class I2C:
    def __init__(self, identity_register, identity):
        self.registers = bytearray(256)
        self.registers[identity_register] = identity
    def set(self, register, data): self.registers[register:register + len(data)] = data
    def writeto_mem(self, address, register, data): self.set(register, bytes(data))
    def readfrom_mem(self, address, register, count): return bytes(self.registers[register:register + count])
    def readfrom_mem_into(self, address, register, into): into[:] = self.readfrom_mem(address, register, len(into))
EOF
}

# A package of npm and its version, in $work/npm.
npm_packages() {
  mkdir -p "$work/npm" && (cd "$work/npm" && npm install --silent --no-audit --no-fund --ignore-scripts "$@" >/dev/null) || exit 2
}

# Modules of Go as NAME@VERSION, required by the module in $work/go, whose main.go is written there afterwards.
go_modules() {
  mkdir -p "$work/go" && cd "$work/go" && export GOPATH=$work/gopath GOCACHE=$work/gocache GOFLAGS="-mod=mod -modcacherw" GOTOOLCHAIN=local
  { printf 'module finding\ngo 1.19\n'; printf 'require %s\n' "${@/@/ }"; } >go.mod
  go mod download || exit 2
}

# Crates as NAME@VERSION, and what they need of the newest versions that this compiler takes, for the program in $work/rust, whose src/main.rs is written there afterwards.
crates() {
  mkdir -p "$work/rust/src" && cd "$work/rust" && export CARGO_HOME=$work/cargo
  { printf '[package]\nname = "finding"\nversion = "0.0.0"\nedition = "2021"\nresolver = "3"\n[dependencies]\n'; printf '%s"\n' "${@/@/ = \"=}"; } >Cargo.toml
  echo 'fn main() {}' >src/main.rs
  cargo -q fetch || exit 2
}

# Artifacts of Maven as GROUP:NAME:VERSION, without what they depend on, for $java.
maven_artifacts() {
  for artifact in "$@"; do
    mvn -q -B -Dmaven.repo.local="$work/maven" dependency:copy "-Dartifact=$artifact" "-DoutputDirectory=$work/jars" >"$work/maven.log" 2>&1 || { tail -5 "$work/maven.log" >&2; exit 2; }
  done
  java=(java -cp "$work/jars/*")
}

# A command in a network of its own, in which nothing leaves the computer.
alone() {
  local user=(--user --map-root-user)
  [ "$(id -u)" -ne 0 ] || user=() # root needs none, and a chroot has none
  unshare "${user[@]}" --net bash -ec 'ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@"' bash "$@"
}

# Compares standard input with the text in $seen.
as_seen() {
  cat >"$work/out"
  cat "$work/out"
  printf '%s\n' "$seen" | diff - "$work/out" >"$work/diff" && { echo "$(basename "$0"): as seen"; return; }
  echo "$(basename "$0"): the behaviour is another one now (< seen, > now):" >&2
  cat "$work/diff" >&2
  exit 1
}
