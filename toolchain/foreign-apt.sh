#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# An apt of its own for another architecture's packages, from this machine's Debian sources: FOLDER/apt.conf, which the environment
# variable APT_CONFIG then names. The host's package state is neither read nor written, and root is not needed.
# usage: foreign-apt.sh ARCH FOLDER      (writes FOLDER/update.log; exit code 1: the package lists could not be fetched)
set -euo pipefail
arch=$1 work=$2
mkdir -p "$work"/{lists,archives}/partial
: >"$work/status"
# The machine's settings (proxies, retries), without hooks, with other folders.
{
  apt-config dump | grep -vE '^(APT::Architectures?|APT::Update::(Pre|Post)-Invoke|DPkg::(Pre|Post)-|Dir::)'
  cat <<EOT
APT::Architecture "$arch";
APT::Architectures { "$arch"; };
Dir::State "$work";
Dir::State::status "$work/status";
Dir::State::lists "$work/lists";
Dir::Cache "$work";
Dir::Cache::archives "$work/archives";
Dir::Etc "$work";
Dir::Etc::sourcelist "$work/sources.list";
Dir::Etc::sourceparts "-";
Dir::Etc::main "-";
Dir::Etc::parts "-";
Dir::Etc::netrc "/etc/apt/auth.conf";
Dir::Etc::netrcparts "/etc/apt/auth.conf.d";
Dir::Etc::trustedparts "/etc/apt/trusted.gpg.d";
EOT
} >"$work/apt.conf"

codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
option=$([ -e "$keyring" ] && echo "[signed-by=$keyring]" || true)
# Debian's own suites are named after the release; other vendors' are not for other architectures.
apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
  awk -v c="$codename" -v o="$option" '$2 == c || index($2, c "-") == 1 {print "deb", o, $1, $2, $3}' | sort -u >"$work/all.list"
[ -s "$work/all.list" ] || {
  echo "no Debian source of '$codename' among this machine's (apt-get indextargets). Debian 12 is what this was made for." >&2
  exit 1
}
update() { # its own words, which are many, are shown if it fails
  env APT_CONFIG="$work/apt.conf" apt-get -q update --error-on=any >"$work/update.log" 2>&1 # APT_CONFIG is read first: no other configuration is
}
cp "$work/all.list" "$work/sources.list"
if ! update; then
  # A mirror's security index is sometimes in the middle of a change. Headers and libraries to compile against may be
  # a point release older: the board installs its own.
  grep -v -- '-security ' "$work/all.list" >"$work/sources.list" || true
  grep -E '^(E|W):' "$work/update.log" >&2 || true
  echo "trying again without the security suite" >&2
  update || { cat "$work/update.log" >&2; exit 1; }
fi
