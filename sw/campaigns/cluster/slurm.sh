#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The campaigns as a Slurm job: one scheduler, a worker for each task, results in a shared folder.
#
#   sbatch --ntasks=64 --export=ALL,K="decoder line",RESULTS=$PWD/build/soak sw/campaigns/cluster/slurm.sh
#
# Submit it in a checkout that all nodes see. A job that ends before its campaigns is submitted again
# as it is: what is done is not repeated.
#SBATCH --job-name=moire-soak
#SBATCH --ntasks=16
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=2G
#SBATCH --time=24:00:00
#SBATCH --requeue
set -euo pipefail
cd "${SLURM_SUBMIT_DIR:-$PWD}"
make build/venv/stamp firmware

PORT=${PORT:-8786}
ADDRESS=tcp://$(hostname):$PORT
DASK=(build/venv/bin/python -m dask) # modules of the checkout are found
mkdir -p build/soak
"${DASK[@]}" scheduler --port "$PORT" > build/soak/scheduler.log 2>&1 &
scheduler=$!
srun "${DASK[@]}" worker "$ADDRESS" --nthreads 1 --no-dashboard --memory-limit 0 --death-timeout 300 \
    > build/soak/workers.log 2>&1 &
workers=$!
trap 'kill "$workers" "$scheduler" 2> /dev/null || true; wait' EXIT

make soak SCHEDULER="$ADDRESS" RESULTS="${RESULTS:-$PWD/build/soak}" K="${K:-}" \
    SCALE="${SCALE:-1}" SEED="${SEED:-1}"
