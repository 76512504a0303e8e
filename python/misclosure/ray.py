"""Works a campaign off on a Ray cluster: ``python -m misclosure.ray CAMPAIGN --address HOST:PORT``.

Each shard of the campaign is a task. A task whose node is lost runs again on another one, and finds what the first one
has kept: the state is the campaign's folder, which every node has to see under the same path.

Without ``--address`` a Ray of this machine alone is started, which listens on 127.0.0.1 and has no dashboard. Usage
statistics are off. Ray's interfaces need no password: everybody who reaches them can run code (see the book's chapter on
campaigns).
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import time
from typing import Any

# Of this machine alone.
LOOPBACK = "127.0.0.1"
# Seconds between two looks at the folder.
LOOK = 2.0
# Shards per processor: of a lost node few cases wait for its shards to run again.
SHARDS_PER_CPU = 4


def _program(*words: str) -> list[str]:
    return [sys.executable, "-m", "misclosure", "--quiet", *words]


def _work(folder: str, shard: str, jobs: int) -> int:
    """Works a shard off; gives the program's exit code."""
    done = subprocess.run(
        _program("campaign", "run", folder, "--shard", shard, "--jobs", str(jobs)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    # 1: cases were given up; the folder has their reasons. Any other failure ends the campaign with the message.
    if done.returncode not in (0, 1):
        raise RuntimeError(f"shard {shard} of {folder}: {done.stderr.strip()}")
    return done.returncode


def status(folder: str) -> dict[str, Any]:
    """What ``misclosure campaign status`` says."""
    told = subprocess.run(
        [*_program("campaign", "status", folder), "--json"], stdout=subprocess.PIPE, text=True, check=True
    )
    counts: dict[str, Any] = json.loads(told.stdout)
    return counts


def work_off(folder: str, address: str | None = None, shards: int | None = None, jobs: int = 1) -> dict[str, Any]:
    """Works a campaign off and gives its status. `shards`: tasks; `jobs`: cases at a time by each."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    ray = importlib.import_module("ray")
    folder = os.path.abspath(folder)
    begun_with = status(folder)
    if not ray.is_initialized():
        if address is None:
            ray.init(include_dashboard=False, _node_ip_address=LOOPBACK, log_to_driver=False)
        else:
            ray.init(address=address, log_to_driver=False)
    processors = int(ray.cluster_resources().get("CPU", 1))
    shards = shards or max(1, min(begun_with["cases"], SHARDS_PER_CPU * processors // jobs))
    # Ray runs a task again whenever its node is lost.
    task = ray.remote(num_cpus=jobs, max_retries=-1)(_work)
    waiting = [task.remote(folder, f"{shard}/{shards}", jobs) for shard in range(1, shards + 1)]
    begun = time.monotonic()
    while waiting:
        finished, waiting = ray.wait(waiting, timeout=LOOK)
        ray.get(finished)
        _tell(status(folder), begun_with["done"], time.monotonic() - begun)
    print(file=sys.stderr)
    return status(folder)


def _tell(counts: dict[str, Any], before: int, seconds: float) -> None:
    done = counts["done"]
    text = f"campaign: {done}/{counts['cases']}"
    if done > before:
        left = (counts["cases"] - done - counts["given_up"]) * seconds / (done - before)
        text += f", about {left:.0f} s left"
    print(f"\r{text}   ", end="", file=sys.stderr, flush=True)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m misclosure.ray", description="Works a campaign off on a Ray cluster."
    )
    parser.add_argument("campaign", help="folder of the campaign, under the same path on every node")
    parser.add_argument("--address", help="HOST:PORT of the cluster, or auto [default: a Ray of this machine alone]")
    parser.add_argument("--shards", type=int, help="tasks [default: four a processor]")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time by each task [default: 1]")
    words = parser.parse_args()
    try:
        counts = work_off(words.campaign, words.address, words.shards, words.jobs)
    except ModuleNotFoundError as error:
        if error.name != "ray":
            raise
        print("error: Ray is not installed: pip install ray", file=sys.stderr)
        return 1
    print(f"{counts['cases']} cases: {counts['done']} done, {counts['given_up']} given up")
    return 1 if counts["given_up"] else 0


if __name__ == "__main__":
    sys.exit(main())
