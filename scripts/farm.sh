#!/usr/bin/env bash
# Shares bakes among processes as docs/farm.md tells, on this machine, and compares the bytes with those of one process: with
# GNU parallel and with Slurm, whichever are there (Debian: `apt-get install parallel slurm-wlm`). Slurm runs as root with a
# configuration of its own and two nodes on this host; one worker is ended by SIGTERM and queued again, and a node is lost twice. `RAYS=20M bash
# scripts/farm.sh MODEL` takes a model of your own.
set -euo pipefail
cd "$(dirname "$0")/.."
model=$(realpath "${1:-data/buildings/office.glb}")
rays=${RAYS:-5M}
cargo build --release --features full
enfilade=$(realpath "${CARGO_TARGET_DIR:-target}/release/enfilade")
out=$(mktemp -d)
daemons=()
finish() {
  for process in "${daemons[@]}"; do kill "$process" 2>/dev/null || true; done
  rm -rf "$out"
}
trap finish EXIT
failed=0

# Whether a file has the bytes of the bake by one process: same WHAT FILE.
same() {
  if cmp -s "$out/whole.pvs" "$2"; then echo "$1: the same bytes, $SECONDS s"; else echo "$1: OTHER BYTES" && failed=1; fi
  SECONDS=0
}

SECONDS=0
"$enfilade" bake "$model" -o "$out/whole.pvs" --rays "$rays" --threads 1 2>/dev/null
echo "one process: $SECONDS s"
SECONDS=0

if command -v parallel >/dev/null; then
  # One model, two workers. {#} counts from 1.
  work="$enfilade bake $model -o $out/parallel.pvs --rays $rays --threads 1"
  seq 2 | parallel -j2 "$work --with \$(({#} - 1))/2:$out/parallel" 2>"$out/parallel.txt" || { cat "$out/parallel.txt" && failed=1; }
  same "GNU parallel, one model, two workers" "$out/parallel.pvs"
  # Many models: a job each.
  mkdir "$out/models"
  for name in a b c; do cp "$model" "$out/models/$name.glb"; done
  parallel -j2 "$enfilade bake {} --rays 100k --threads 1" ::: "$out"/models/*.glb 2>"$out/parallel.txt" ||
    { cat "$out/parallel.txt" && failed=1; }
  echo "GNU parallel, many models: $(find "$out/models" -name '*.pvs' | wc -l) of 3 baked, $SECONDS s"
  SECONDS=0
else
  echo "not run: GNU parallel is not there"
fi

if ! command -v slurmctld >/dev/null || [ "$(id -u)" != 0 ]; then
  echo "not run: Slurm is not there, or this is not root"
  exit $failed
fi
slurm=$out/slurm
mkdir -p "$slurm/state"
cat >"$slurm/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=localhost
SlurmUser=root
AuthType=auth/none
CredType=cred/none
AuthInfo=cred_expire=5
ProctrackType=proctrack/linuxproc
ReturnToService=2
RequeueExit=1,75,137
SlurmdTimeout=10
SlurmctldPort=17817
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool-%n
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd-%n.pid
NodeName=n[1-2] NodeAddr=127.0.0.1 NodeHostname=$(hostname) Port=[17821-17822] CPUs=1 State=UNKNOWN
PartitionName=bake Nodes=n[1-2] Default=YES
CONF
export SLURM_CONF=$slurm/slurm.conf
slurmctld -D >"$slurm/slurmctld.log" 2>&1 &
daemons+=($!)
for node in n1 n2; do
  slurmd -D -N $node >"$slurm/$node.log" 2>&1 &
  daemons+=($!)
done
cat >"$slurm/worker.sh" <<JOB
#!/bin/sh
exec "$enfilade" bake "$model" -o "\$1.pvs" --rays $rays --threads 1 --with "\$SLURM_ARRAY_TASK_ID/2:\$1"
JOB
chmod +x "$slurm/worker.sh"

# Starts two workers in a folder, and waits until both are at work: the job's number goes to `job`.
start() {
  for _ in $(seq 60); do [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 2 ] && break; sleep 1; done
  SECONDS=0
  job=$(sbatch --parsable --array=0-1 -n1 --requeue --open-mode=append -o "$1.%a.txt" "$slurm/worker.sh" "$1")
  for _ in $(seq 60); do [ -s "$1/worker-0" ] && [ -s "$1/worker-1" ] && break; sleep 1; done
}

# Waits until a job is through.
ended() {
  for _ in $(seq 300); do [ -n "$(squeue -h -j "$job" 2>/dev/null)" ] || return 0; sleep 1; done
  echo "job $job doesn't end" && failed=1
}

# Exit code 1 queues a worker again, as slurm.conf says.
start "$out/slurm-ended"
scancel -b -s TERM "${job}_1"
ended
same "Slurm, one model, two workers, one of them ended and queued again" "$out/slurm-ended.pvs"

# A node goes with the worker on it, or its worker lives on: then its successor finds the place taken, or the work done.
for lives in "" "; its worker lives on"; do
  start "$out/slurm-node${lives:+-lives}"
  node=$(squeue -h -j "${job}_1" -o %N)
  task=$(squeue -h -j "${job}_1" -o %A)
  step=$(pgrep -f "slurmstepd: \[$task.batch\]")
  worker=$(pgrep -P "$step")
  kill -9 "$step" "$(pgrep -f "slurmd -D -N $node")"
  [ -n "$lives" ] || kill -9 "$worker" 2>/dev/null || true
  sleep 12
  slurmd -D -N "$node" >>"$slurm/$node.log" 2>&1 &
  daemons+=($!)
  ended
  same "Slurm, one model, two workers, one node lost$lives" "$out/slurm-node${lives:+-lives}.pvs"
done
exit $failed
