# SPDX-License-Identifier: Apache-2.0
# Other scripts source this file. It starts a Slurm cluster of one node, this machine, which is independent of the system's Slurm: keys,
# ports, sockets, logs and state are in a scratch folder. Needs slurm-wlm and munge, but no root.
#   start_slurm     starts the cluster and exports SLURM_CONF for sbatch, squeue, scontrol
#   stop_slurm      ends the cluster and its jobs; must be called in every case: trap stop_slurm EXIT
#   wait_for_job NUMBER SECONDS     waits until the job has ended, prints its state, and fails if that is not COMPLETED
slurm_folder=""
slurm_processes=()

# Prints a port without a listener, below the ports that the system assigns.
free_port() {
  local port
  while :; do
    port=$((20000 + RANDOM % 10000))
    (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
  done
}

start_slurm() {
  local user host ctld_port d_port
  user=$(id -un)
  host=$(hostname -s)
  slurm_folder=$(mktemp -d /tmp/twocone-slurm.XXXXXX) # short, because the path of a socket has at most 107 letters
  mkdir -m 700 "$slurm_folder/munge"
  mkdir "$slurm_folder/state" "$slurm_folder/spool"
  head -c 128 /dev/urandom >"$slurm_folder/munge/key"
  chmod 600 "$slurm_folder/munge/key"
  # Every user of the socket must be able to enter its folder; here this is the same user.
  munged --foreground --force --key-file="$slurm_folder/munge/key" --socket="$slurm_folder/munge/socket" \
    --pid-file="$slurm_folder/munge/pid" --log-file="$slurm_folder/munge/log" --seed-file="$slurm_folder/munge/seed" \
    >"$slurm_folder/munge.out" 2>&1 &
  slurm_processes+=($!)
  ctld_port=$(free_port)
  d_port=$(free_port)
  cat >"$slurm_folder/slurm.conf" <<END
ClusterName=twocone
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$ctld_port
SlurmdPort=$d_port
AuthType=auth/munge
AuthInfo=socket=$slurm_folder/munge/socket
CredType=cred/munge
SlurmUser=$user
SlurmdUser=$user
StateSaveLocation=$slurm_folder/state
SlurmdSpoolDir=$slurm_folder/spool
SlurmctldPidFile=$slurm_folder/slurmctld.pid
SlurmdPidFile=$slurm_folder/slurmd.pid
SlurmctldLogFile=$slurm_folder/slurmctld.log
SlurmdLogFile=$slurm_folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
KillWait=5
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
  export SLURM_CONF=$slurm_folder/slurm.conf
  for _ in $(seq 100); do
    [ -S "$slurm_folder/munge/socket" ] && break
    sleep 0.1
  done
  slurmctld -D >"$slurm_folder/slurmctld.out" 2>&1 &
  slurm_processes+=($!)
  slurmd -D -N "$host" >"$slurm_folder/slurmd.out" 2>&1 &
  slurm_processes+=($!)
  for _ in $(seq 300); do
    [ "$(sinfo --noheader --format=%T 2>/dev/null)" = idle ] && return 0
    sleep 0.2
  done
  echo "slurm_node: the node does not start: $(tail -n 3 "$slurm_folder"/*.out "$slurm_folder"/*.log 2>/dev/null)" >&2
  return 1
}

stop_slurm() {
  [ -n "$slurm_folder" ] || return 0
  scancel --user "$(id -un)" 2>/dev/null || true
  for _ in $(seq 50); do
    [ -z "$(squeue --noheader 2>/dev/null)" ] && break
    sleep 0.2
  done
  local process
  for process in $(printf '%s\n' "${slurm_processes[@]}" | tac); do
    kill "$process" 2>/dev/null || true
    for _ in $(seq 50); do kill -0 "$process" 2>/dev/null && sleep 0.2 || break; done
    kill -9 "$process" 2>/dev/null || true
    wait "$process" 2>/dev/null || true
  done
  rm -rf "$slurm_folder"
  slurm_folder=""
  slurm_processes=()
  unset SLURM_CONF
}

wait_for_job() {
  local state="" until=$((SECONDS + $2))
  while ((SECONDS < until)); do
    # An array has a line for each task; the controller removes old jobs from its list.
    state=$(scontrol --oneliner show job "$1" 2>/dev/null | grep -o 'JobState=[A-Z_]*' | sed 's/.*=//' | sort -u | tr '\n' ' ')
    case " $state" in
      *" PENDING "* | *" RUNNING "* | *" COMPLETING "* | *" CONFIGURING "*) sleep 0.5 ;;
      *) break ;;
    esac
  done
  echo "${state:-unknown}"
  [ "$state" = "COMPLETED " ]
}
