"""A campaign on Ray: two nodes on this machine, one of which is lost."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

ray = pytest.importorskip("ray", reason="ray is not installed: campaigns on a cluster are NOT tested")

GRID = Path(__file__).parents[2] / "campaigns" / "small.toml"


def program(*words):
    subprocess.run([sys.executable, "-m", "misclosure", "--quiet", *map(str, words)], check=True)


def gathered(folder):
    program("campaign", "gather", folder)
    return {name: (folder / name).read_bytes() for name in ("results.csv", "candidates.csv", "estimates.csv")}


def test_a_lost_node_loses_no_case(tmp_path):
    from ray.cluster_utils import Cluster

    from misclosure.ray import work_off

    grid = tmp_path / "grid.toml"
    grid.write_text(GRID.read_text().replace('"1..5"', '"1..12"'))
    alone, shared = tmp_path / "alone", tmp_path / "shared"
    for folder in (alone, shared):
        program("campaign", "plan", grid, "-o", folder)
    program("campaign", "run", alone)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    lost = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()

    def lose():
        while len(list((shared / "results").rglob("*.json"))) < 10:
            time.sleep(0.1)
        cluster.remove_node(lost, allow_graceful=False)

    thread = threading.Thread(target=lose)
    thread.start()
    try:
        counts = work_off(str(shared), cluster.address, shards=6)
    finally:
        thread.join()
        ray.shutdown()
        cluster.shutdown()
    assert counts["done"] == counts["cases"] == 36
    assert gathered(shared) == gathered(alone)
