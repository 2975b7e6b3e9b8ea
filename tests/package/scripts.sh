#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Small files of the packages: the configuration that is installed is right, shells can read the completions and complete by
# them, manual pages have no mistakes, maintainer scripts are plain sh.
set -u
failures=0
fail() { echo "FAIL: $*"; failures=$((failures + 1)); }
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT

# As installed, but with a folder that is there.
cp config/etc/* "$dir"
sed -i "s#/var/lib/waymark#$dir#g" "$dir/robot.yaml"
said=$("$WM_BIN_DIR/waymark" check "$dir/robot.yaml") || fail "the installed configuration: $said"
tail -1 <<<"$said" | grep -qx good || fail "the installed configuration: $said"

completed() { # WORD...: what bash offers for the last one
  bash -c 'source toolchain/package/completion/waymark.bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _waymark; echo "${COMPREPLY[@]}"' - "$@"
}
[ "$(completed waymark rep)" = "replay report" ] || fail "waymark rep<TAB>: $(completed waymark rep)"
[ "$(completed waymark run --la)" = "--landmarks" ] || fail "waymark run --la<TAB>: $(completed waymark run --la)"
[ "$(completed waymark map pr)" = "print-markers" ] || fail "waymark map pr<TAB>: $(completed waymark map pr)"
[ "$(completed waymark map make --re)" = "--resolution" ] || fail "waymark map make --re<TAB>: $(completed waymark map make --re)"
if command -v zsh >/dev/null; then
  zsh -n toolchain/package/completion/_waymark || fail "_waymark"
fi

if command -v mandoc >/dev/null; then
  said=$(mandoc -T lint -W error toolchain/package/man/*.1) || fail "manual pages: $said"
fi
for script in toolchain/package/{,ros2/}{postinst,prerm,postrm}; do
  sh -n "$script" || fail "$script"
done
exit $((failures > 0))
