#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Metrics of a run: `waymark watch --metrics` and /metrics of the live page say what the run does, and that it is gone. The
# parser of prometheus_client (tests/judges) reads both; prometheus itself, where it is, reads the page. metrics.sh BIN.
# In a network of its own; skipped (77) where there is no right to one.
set -euo pipefail
if [ "${WM_OWN_NETWORK:-}" != 1 ]; then
  unshare -rn true 2>/dev/null || { echo "skipped: no right to a network namespace"; exit 77; }
  exec env WM_OWN_NETWORK=1 unshare -rn bash "$0" "$@"
fi
unset http_proxy HTTP_PROXY # of this computer alone
bin=$(readlink -f "$1")
dir=$(mktemp -d)
pids=()
trap 'kill "${pids[@]}" 2>/dev/null || true; wait; rm -r "$dir"' EXIT
ip link set lo up
ip route add 224.0.0.0/4 dev lo
fail() { echo "metrics.sh: $*" >&2; cat "$dir"/*.prom "$dir"/*.log >&2 || true; exit 1; }

mkdir "$dir/rec"
cat >"$dir/rec/recording.yaml" <<'EOT'
format: waymark-recording/1
name: straight
streams: [motion.csv]
vehicle: {initial_pose: {t_ns: 0, x_m: 1, y_m: 2, heading_rad: 0}}
EOT
{
  echo t_ns,v_mps,w_radps
  for i in $(seq 0 1499); do echo "$((i * 20))000000,0.5,0"; done
} >"$dir/rec/motion.csv"
printf 'format: waymark-config/1\nestimator: odometry\nrealtime: {lock_memory: false}\n' >"$dir/config.yaml"

"$bin/waymark" watch --metrics "$dir/waymark.prom" >"$dir/watch.log" 2>&1 &
watch=$!
pids+=("$watch")
[ -x "$bin/waymark-web" ] && { "$bin/waymark-web" "$dir/config.yaml" --listen 127.0.0.1:8085 >"$dir/web.log" 2>&1 & pids+=($!); }
"$bin/waymark" run --config "$dir/config.yaml" --recording "$dir/rec" >"$dir/run.log" 2>&1 &
run=$!
pids+=("$run")
for _ in $(seq 100); do
  grep -qE '^waymark_source_received_total\{source="motion"\} [1-9]' "$dir/waymark.prom" 2>/dev/null && break
  sleep 0.2
done
cp "$dir/waymark.prom" "$dir/first.prom" || fail "no file"
grep -qx 'waymark_up 1' "$dir/first.prom" || fail "the run is not up"
grep -qx 'waymark_state{state="dead_reckoning"} 1' "$dir/first.prom" || fail "another state"
grep -qE '^waymark_source_received_total\{source="motion"\} [1-9]' "$dir/first.prom" || fail "no data counted"
judge() {
  .cache/venv/bin/python -c 'import prometheus_client' 2>/dev/null || { echo "not judged: tests/judges/setup.sh has not run"; return 0; }
  .cache/venv/bin/python - "$1" <<'EOT' || fail "prometheus_client refuses $1"
import sys
from prometheus_client.parser import text_string_to_metric_families
families = list(text_string_to_metric_families(open(sys.argv[1]).read()))
for family in families:
    assert family.documentation and family.type in ("gauge", "counter"), family
names = [family.name for family in families]
samples = [(sample.name, *sorted(sample.labels.items())) for family in families for sample in family.samples]
assert len(set(names)) == len(names) and len(set(samples)) == len(samples), "something is there twice"
print("prometheus_client reads", len(families), "metrics of", len(samples), "samples")
EOT
}
judge "$dir/first.prom"
if [ -x "$bin/waymark-web" ]; then
  python3 - "$dir/page.prom" <<'EOT'
import sys, urllib.request
answer = urllib.request.urlopen("http://127.0.0.1:8085/metrics", timeout=10)
assert answer.headers["Content-Type"] == "text/plain; version=0.0.4; charset=utf-8", answer.headers
open(sys.argv[1], "wb").write(answer.read())
EOT
  grep -qx 'waymark_up 1' "$dir/page.prom" || fail "the page has no run"
  [ "$(grep -c '^# TYPE' "$dir/page.prom")" = "$(grep -c '^# TYPE' "$dir/waymark.prom")" ] || fail "page and file differ"
  judge "$dir/page.prom"
fi
if [ -x "$bin/waymark-web" ] && command -v prometheus >/dev/null; then
  printf 'scrape_configs: [{job_name: waymark, scrape_interval: 1s, static_configs: [{targets: ["localhost:8085"]}]}]\n' >"$dir/prometheus.yml"
  prometheus --config.file="$dir/prometheus.yml" --storage.tsdb.path="$dir/tsdb" --web.listen-address=127.0.0.1:9099 >"$dir/prometheus.log" 2>&1 &
  pids+=($!)
  python3 - <<'EOT' || fail "Prometheus has no pose"
import json, sys, time, urllib.request
for _ in range(60):
    try:
        text = urllib.request.urlopen("http://127.0.0.1:9099/api/v1/query?query=waymark_poses_published_total", timeout=5).read()
        found = json.loads(text)["data"]["result"]
        if found and float(found[0]["value"][1]) > 0:
            sys.exit(print("Prometheus has", found[0]["metric"]["__name__"], found[0]["value"][1]))
    except OSError:
        pass
    time.sleep(0.5)
sys.exit(1)
EOT
fi
kill "$run"
for _ in $(seq 60); do
  grep -qx 'waymark_up 0' "$dir/waymark.prom" && break
  sleep 0.2
done
[ "$(grep -c '^waymark_' "$dir/waymark.prom")" = 1 ] || fail "a run that is gone has more than waymark_up 0"
kill -INT "$watch"
wait "$watch" || fail "watch ended with $?"
[ ! -e "$dir/waymark.prom" ] || fail "the file outlived its program"
echo "metrics of a run, by file and page, until it is gone"
