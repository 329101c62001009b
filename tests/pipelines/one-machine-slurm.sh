#!/bin/bash
# one-machine-slurm.sh COMMAND...: runs COMMAND beside a Slurm of this machine alone, then stops it.
#
# slurmctld, one slurmd and munged of Debian's packages, as this user, on free ports of 127.0.0.1, with all state in a
# temporary folder; a Slurm that the machine already has is not touched. COMMAND finds it through SLURM_CONF. No cgroups, no
# accounting: works in a container. The node is said to have 4 processors, whatever the machine has.
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: one-machine-slurm.sh COMMAND..." >&2; exit 2; }
PATH=$PATH:/usr/sbin
for program in munged slurmctld slurmd sbatch; do
  command -v $program > /dev/null || {
    echo "one-machine-slurm.sh: $program is not installed; packages: cmake/packages/slurm.txt" >&2; exit 1; }
done

folder=$(mktemp -d -t palpate_slurm_XXXXXX)
chmod 755 "$folder" # munged insists that all can reach its socket
mkdir "$folder"/{munge,state,spool,tmp}
user=$(id -un)

stop() {
  if [ -s "$folder/slurmctld.pid" ]; then
    scancel --user="$user" || true # a job outlives its slurmd
    for _ in {1..150}; do [ -n "$(squeue --noheader 2> /dev/null)" ] || break; sleep 0.1; done
    scontrol shutdown || true # slurmctld and slurmd
  fi
  for daemon in slurmd slurmctld munge; do wait_for_end "$folder/$daemon.pid"; done
  rm -rf "$folder"
}
# The process of a pid file gets a SIGTERM and ten seconds.
wait_for_end() {
  local pid
  pid=$(cat "$1" 2> /dev/null) || return 0
  kill "$pid" 2> /dev/null || return 0
  for _ in {1..100}; do kill -0 "$pid" 2> /dev/null || return 0; sleep 0.1; done
  kill -KILL "$pid" 2> /dev/null || true
}
trap stop EXIT

read -r controller_port node_port < <(python3 -c '
import socket
ends = [socket.socket() for _ in range(2)]
for end in ends: end.bind(("127.0.0.1", 0))
print(*(end.getsockname()[1] for end in ends))')
host=$(hostname -s)
cat > "$folder/slurm.conf" << END
ClusterName=one-machine
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$controller_port
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
MpiDefault=none
KillWait=5
ReturnToService=2
NodeName=one NodeHostname=$host NodeAddr=127.0.0.1 Port=$node_port CPUs=4 RealMemory=8000
PartitionName=all Nodes=one Default=YES MaxTime=INFINITE State=UP
END
echo "PMIxCliTmpDirBase=$folder/tmp" > "$folder/mpi.conf"
export SLURM_CONF=$folder/slurm.conf

(umask 077; head -c 128 /dev/urandom > "$folder/munge/key")
munged --socket="$folder/munge/socket" --key-file="$folder/munge/key" --seed-file="$folder/munge/seed" \
  --pid-file="$folder/munge.pid" --log-file="$folder/munge/log"
slurmctld
slurmd -N one
for _ in {1..100}; do
  [ "$(sinfo --noheader --format=%t 2> /dev/null)" != idle ] || break
  sleep 0.1
done
[ "$(sinfo --noheader --format=%t)" = idle ] || { tail -n 20 "$folder"/slurm*.log >&2; exit 1; }

"$@"
