#!/usr/bin/env python3
"""compare_solvers.py OUT [PROBLEM ...]: our solvers and others on the problems of the validation suite, judged by its certificates.

Needs `misclosure` on the path, from PyPI pycolmap and gtsam, and cargo for apex-solver (scripts/apex, built here): what is not installed
is left out, and said. Each solve is a process of its own, whose time is that of the solve alone and whose memory is its peak. The table is
printed as Markdown (docs/validation.md has it) and stands in OUT/comparison.json with everything else.
"""

import importlib.util
import json
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

OTHERS = ["pycolmap", "pycolmap-tight", "gtsam", "apex-solver", "apex-solver-tight", "apex-solver-gn"]


def adjust_with_pycolmap(entry, folder, tight):
    """COLMAP's bundle adjustment, stopped as it stops by itself or as late as it can."""
    import pycolmap

    model = pycolmap.Reconstruction(folder / "colmap")
    options = pycolmap.BundleAdjustmentOptions()
    for key, value in entry["colmap"].items():
        setattr(options, key, value)
    options.print_summary = False
    if entry["loss"] == "cauchy":
        options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
        options.ceres.loss_function_scale = entry["loss_scale_px"]
    if tight:
        solver = options.ceres.solver_options
        solver.gradient_tolerance = solver.function_tolerance = solver.parameter_tolerance = 1e-16
        solver.max_num_iterations = 500
    config = pycolmap.BundleAdjustmentConfig()
    for image in model.images:
        config.add_image(image)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    started = time.perf_counter()
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    return model, time.perf_counter() - started


def adjust_with_gtsam(entry, folder):
    """Factors of a camera with f, k1 and k2, shared by the images that were taken with it; the datum by a pose and a distance."""
    import gtsam
    import numpy as np
    import pycolmap

    if not (entry["colmap"]["refine_extra_params"] and not entry["colmap"]["refine_principal_point"] and entry["loss"] == "none"):
        return None
    model = pycolmap.Reconstruction(folder / "colmap")
    if any(camera.model.name != "RADIAL" for camera in model.cameras.values()):
        return None
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Isotropic.Sigma(2, entry["sigma_px"])
    key = gtsam.symbol
    for number, camera in model.cameras.items():
        f, cx, cy, k1, k2 = camera.params
        values.insert(key("k", number), gtsam.Cal3Bundler(f, k1, k2, cx, cy))
    for number, image in model.images.items():
        pose = image.cam_from_world().inverse()
        values.insert(key("x", number), gtsam.Pose3(gtsam.Rot3(pose.rotation.matrix()), pose.translation))
        for element in image.points2D:
            if element.has_point3D():
                factor = gtsam.GeneralSFMFactor2Cal3Bundler(
                    element.xy, noise, key("x", number), key("p", element.point3D_id), key("k", image.camera_id)
                )
                graph.add(factor)
    for number, point in model.points3D.items():
        values.insert(key("p", number), point.xyz)
    # Seven observations that contradict no measurement hold the datum: a pose, and the distance to the one farthest from it.
    numbers = sorted(model.images)
    first = values.atPose3(key("x", numbers[0]))
    graph.add(gtsam.PriorFactorPose3(key("x", numbers[0]), first, gtsam.noiseModel.Isotropic.Sigma(6, 1e-3)))
    away = lambda n: values.atPose3(key("x", n)).translation() - first.translation()
    far = max(numbers[1:], key=lambda n: np.linalg.norm(away(n)))
    distance = float(np.linalg.norm(away(far)))
    graph.add(gtsam.RangeFactorPose3(key("x", numbers[0]), key("x", far), distance, gtsam.noiseModel.Isotropic.Sigma(1, 1e-3)))
    parameters = gtsam.LevenbergMarquardtParams.CeresDefaults()
    parameters.setMaxIterations(500)
    parameters.setRelativeErrorTol(1e-16)
    parameters.setAbsoluteErrorTol(1e-16)
    started = time.perf_counter()
    found = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize()
    seconds = time.perf_counter() - started
    for number, camera in model.cameras.items():
        k = found.atCal3Bundler(key("k", number))
        camera.params = [k.fx(), camera.params[1], camera.params[2], k.k1(), k.k2()]
    for number, image in model.images.items():
        pose = found.atPose3(key("x", number))
        rotation = pycolmap.Rotation3d(pose.rotation().matrix())
        image.frame.rig_from_world = pycolmap.Rigid3d(rotation, pose.translation()).inverse()
    for number, point in model.points3D.items():
        point.xyz = found.atPoint3(key("p", number))
    return model, seconds


def solve(solver, suite, name, result):
    """One solve in this process; writes the result and prints what it took."""
    entry = next(entry for entry in problems(suite) if entry["name"] == name)
    folder = suite / name
    if solver == "gtsam":
        solved = adjust_with_gtsam(entry, folder)
    else:
        solved = adjust_with_pycolmap(entry, folder, solver.endswith("tight"))
    if solved is None:
        return print(json.dumps({"expressible": False}))
    model, seconds = solved
    result.mkdir(parents=True, exist_ok=True)
    model.write(result)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"expressible": True, "seconds": seconds, "megabytes": peak}))


def problems(suite):
    return json.loads((suite / "suite.json").read_text())["problems"]


def misclosure(*arguments):
    """JSON of a command; it ends with 4 where a result is not as certified."""
    done = subprocess.run(["misclosure", *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 4):
        sys.exit(f"misclosure {' '.join(map(str, arguments))}: {done.stderr}")
    return json.loads(done.stdout)


def ours(solver, suite, names):
    """Our solvers through `validate`; the memory of a process that adjusts the block."""
    rows = {}
    for row in misclosure("validate", *names, "--solver", solver)["results"]:
        rows[row["problem"]] = {"seconds": row["seconds"], "digits": row.get("score", {}).get("digits")}
    for name in names:
        own = suite / name
        command = ["misclosure", "adjust", own / "block", "-o", own / f"run-{solver}", "--model", own / "model.toml"]
        child = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL); "
        child += "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)"
        command += ["--solver", solver, "--outliers", "none"]
        done = subprocess.run([sys.executable, "-c", child, *map(str, command)], capture_output=True, text=True)
        rows[name]["megabytes"] = float(done.stdout)
    return rows


def apex(out):
    """The program that solves with apex-solver, built where cargo is at hand; else None."""
    if shutil.which("cargo") is None:
        return None
    target = (out / "apex-target").resolve()
    manifest = Path(__file__).parent / "apex" / "Cargo.toml"
    command = ["cargo", "build", "--release", "--locked", "--manifest-path", manifest, "--target-dir", target]
    if subprocess.run([str(part) for part in command], stdout=sys.stderr).returncode != 0:
        print("scripts/apex cannot be built", file=sys.stderr)
        return None
    return target / "release" / "apex"


def others(solver, suite, names, out, program):
    """Any other solver: a program that gets the solver, the suite, the problem and where the result goes, and says what it took."""
    shutil.rmtree(out / solver, ignore_errors=True)
    rows = {}
    for name in names:
        command = [*program, solver, suite, name, out / solver / name]
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
        lines = done.stdout.strip().splitlines()
        if done.returncode != 0 or not lines:
            reason = (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]
            rows[name] = {"expressible": True, "failure": reason}
            continue
        rows[name] = json.loads(lines[-1])
    if any((out / solver / name).is_dir() for name in names):
        for row in misclosure("validate", "--judge", out / solver)["results"]:
            if row["problem"] in rows:
                rows[row["problem"]]["digits"] = row.get("score", {}).get("digits")
    return rows


def main(out, names):
    suite = out / "suite"
    misclosure("validate", "--suite", suite, *(names or ["--quick"]))
    listed = problems(suite)
    expressible = [entry["name"] for entry in listed if entry["colmap"]]
    table = {solver: ours(solver, suite, expressible) for solver in ("native", "ceres")}
    rust = apex(out)
    for solver in OTHERS:
        if solver.startswith("apex"):
            program = rust and [rust]
        else:
            program = importlib.util.find_spec(solver.split("-")[0]) and [sys.executable, __file__, "--solve"]
        if program is None:
            print(f"{solver} is not installed: left out", file=sys.stderr)
            continue
        table[solver] = others(solver, suite, expressible, out, program)
    (out / "comparison.json").write_text(json.dumps({"problems": listed, "results": table}, indent=1))

    def cell(row):
        if not row.get("expressible", True):
            return "cannot express it"
        if row.get("digits") is None:
            return row.get("failure", "failed")
        return f"{row['digits']:.1f} ({row['seconds']:.2g} s, {row['megabytes']:.0f} MB)"

    print("| problem | " + " | ".join(table) + " |")
    print("|---" * (len(table) + 1) + "|")
    for name in expressible:
        print(f"| {name} | " + " | ".join(cell(rows[name]) for rows in table.values()) + " |")
    why = {}
    for entry in listed:
        if not entry["colmap"]:
            why.setdefault(entry["not_expressible"], []).append(entry["name"])
    for reason, those in why.items():
        print(f"\nNot expressible for {reason}: {', '.join(those)}.")
    for solver, rows in table.items():
        for reason in sorted({row["why"] for row in rows.values() if "why" in row}):
            those = [name for name, row in rows.items() if row.get("why") == reason]
            print(f"\n{solver} has {reason}: {', '.join(those)}.")


if __name__ == "__main__":
    if sys.argv[1] == "--solve":
        solve(sys.argv[2], Path(sys.argv[3]), sys.argv[4], Path(sys.argv[5]))
    else:
        main(Path(sys.argv[1]), sys.argv[2:])
