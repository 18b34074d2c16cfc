#!/usr/bin/env python3
"""A list of programs over the workers of a Dask cluster that see one folder, and the summary of all of them.

    pip install distributed
    python examples/dask/batch.py list.txt --out out --shards 8 --scheduler tcp://head:8786

Without --scheduler the workers are processes of this machine. Dask starts the shard of a worker that was lost again on another one:
what had been done is known by its record, and is not done again."""

import argparse
import os
import subprocess
import sys


def shard(command, programs, out, part, parts):
    """One shard, by `feedwright batch`; what it says goes to a log beside the programs. Returns its exit code."""
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, f"shard-{part}-of-{parts}.log"), "ab", buffering=0) as log:
        log.write(f"process {os.getpid()}\n".encode())
        return subprocess.call(
            [*command, "batch", programs, "--out", out, "--shard", f"{part}/{parts}", "--threads", "1"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )


def submit(client, command, programs, out, parts):
    """Hands all shards to the cluster."""
    return [client.submit(shard, command, programs, out, part, parts) for part in range(1, parts + 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", help="a folder or a list of programs, as for feedwright batch")
    parser.add_argument("--out", required=True, help="folder that all workers see")
    parser.add_argument("--shards", type=int, default=4)
    parser.add_argument("--scheduler", help="address of a cluster; without it processes of this machine")
    given = parser.parse_args()
    from distributed import Client

    programs, out = os.path.abspath(given.programs), os.path.abspath(given.out)
    with Client(given.scheduler) if given.scheduler else Client(threads_per_worker=1) as client:
        client.gather(submit(client, ["feedwright"], programs, out, given.shards))
    return subprocess.call(["feedwright", "merge", programs, "--out", out, "--json", os.path.join(out, "summary.json")])


if __name__ == "__main__":
    sys.exit(main())
