#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The shipped Snakefile and profile on a Slurm of two nodes, made on this computer: the same sum as `waymark batch` alone.
#   slurm.sh BIN PLAN.yaml [PARTS]     as root; packages: slurmctld slurmd slurm-client munge snakemake
set -euo pipefail
[ $# -ge 2 ] || { sed -n '3,4s/^# *//p' "$0"; exit 2; }
bin=$(realpath "$1") plan=$(realpath "$2") parts=${3:-8}
root=$(realpath "$(dirname "$0")/../..")
for program in slurmctld slurmd munged sbatch snakemake; do
  PATH=$PATH:/usr/sbin command -v $program >/dev/null || { echo "SKIPPED: $program is missing: sudo apt-get install slurmctld slurmd slurm-client munge snakemake"; exit 77; }
done

work=$(mktemp -d /tmp/waymark-slurm-XXXXXX)
started=()
finish() {
  for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap finish EXIT

host=$(hostname -s)
mkdir -p "$work"/{state,n1,n2,munge}
chmod 700 "$work/munge"
head -c 1024 /dev/urandom > "$work/munge/key"
chmod 400 "$work/munge/key"
chown -R root:root "$work/munge"
# Two nodes with a processor each. Slurm counts the processors that the configuration states, not those of the host.
cat > "$work/slurm.conf" <<CONF
ClusterName=waymark
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
SlurmctldPort=16817
StateSaveLocation=$work/state
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/%n/slurmd.pid
SlurmdSpoolDir=$work/%n
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
MpiDefault=none
ReturnToService=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=16821 CPUs=2
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=16822 CPUs=2
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf PATH=$PATH:/usr/sbin

begin() {
  "$@" > "$work/${#started[@]}-$(basename "$1").out" 2>&1 &
  started+=($!)
}
begin munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed"
for _ in $(seq 100); do [ -S "$work/munge/socket" ] && break; sleep 0.1; done
[ -S "$work/munge/socket" ] || { cat "$work"/*munged.out; exit 1; }
begin slurmctld -D
begin slurmd -D -N n1
begin slurmd -D -N n2
for _ in $(seq 300); do
  [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 2 ] && break
  sleep 0.1
done
sinfo -N -l
[ "$(sinfo -h -t idle -o %D)" = 2 ] || { tail -5 "$work"/*.log; exit 1; }

cp -r "$root/tools/fleet/slurm" "$work/profile"
begun=$(date +%s)
snakemake -s "$root/tools/fleet/Snakefile" --profile "$work/profile" --latency-wait 10 --config plan="$plan" out="$work/cluster" parts="$parts" \
  batch="python3 $bin/waymark-batch" > "$work/snakemake.out" 2>&1 || { tail -20 "$work/snakemake.out"; exit 1; }
echo "$parts parts on two nodes: $(grep -c 'Submitted job' "$work/snakemake.out") jobs in $(($(date +%s) - begun)) s"
grep -o 'NodeList=n[12]' "$work/slurmctld.log" | sort | uniq -c
alone=$(python3 "$bin/waymark-batch" "$plan" --out "$work/alone" 2>/dev/null | tail -1)
cluster=$(python3 "$bin/waymark-batch" "$plan" --out "$work/cluster" 2>/dev/null | tail -1)
echo "alone:   $alone"
echo "cluster: $cluster"
[ "$(grep -o 'sum [0-9a-f]*' <<<"$alone")" = "$(grep -o 'sum [0-9a-f]*' <<<"$cluster")" ]
