"""Long work: threads, progress, Ctrl-C, pictures, files."""

import _thread
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import misclosure


def test_two_threads_give_what_each_gives_alone(small, truth):
    blocks = [small, truth.inject(["focal-growth", "noise:px=0.3"], seed=2)]
    alone = [block.diagnose().json for block in blocks]
    together = [None, None]

    def diagnose(k):
        together[k] = blocks[k].diagnose().json

    threads = [threading.Thread(target=diagnose, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone


def test_other_threads_go_on_meanwhile(shutter):
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.01)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    shutter.diagnose()
    took = time.monotonic() - begun
    done.set()
    thread.join()
    during = [at for at in ticks if begun < at < begun + took]
    assert len(during) > 10 * took, f"{len(during)} ticks in {took:.1f} s"


def test_ctrl_c_stops_within_a_second():
    # A block that takes half a minute.
    block = misclosure.Block.simulate("mapping", points=20000, seed=1).inject("noise", px=0.3)
    begun = []

    def interrupt(_):
        if not begun:
            begun.append(time.monotonic())
            threading.Timer(0.5, _thread.interrupt_main).start()

    with pytest.raises(KeyboardInterrupt):
        block.improve(progress=interrupt)
    took = time.monotonic() - begun[0]
    assert 0.5 <= took < 1.5, took


def test_a_callback_that_raises_ends_the_work(shutter):
    class Enough(Exception):
        pass

    def callback(text):
        assert isinstance(text, str)
        raise Enough

    with pytest.raises(Enough):
        shutter.improve(progress=callback)


def test_progress_tells_the_steps(small, capsys):
    steps = []
    small.adjust(progress=steps.append)
    assert any(step.startswith("native: iteration 1, cost ") for step in steps)
    with pytest.raises(misclosure.errors.InputError, match="progress=3: expected a function"):
        small.adjust(progress=3)


def test_work_survives_a_fork(small):
    expected = small.adjust().sigma0
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(write, repr(small.adjust().sigma0).encode())
        os._exit(0)
    os.close(write)
    assert float(os.read(read, 100)) == expected
    assert os.waitpid(child, 0)[1] == 0


def test_import_is_quick_and_leaves_numpy_alone():
    code = "import sys, time; t = time.perf_counter(); import misclosure; t = time.perf_counter() - t"
    code += "; print(t, 'numpy' in sys.modules)"
    command = [sys.executable, "-c", code]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() for _ in range(3)]
    assert all(own[1] == "False" for own in runs)
    assert min(float(own[0]) for own in runs) < 0.3


def test_command(program):
    assert program("--version").stdout.startswith(f"misclosure {misclosure.__version__}")
    assert "error: unrecognized subcommand 'nothing'" in program("nothing", code=2).stderr


def test_command_ends_at_ctrl_c(tmp_path):
    command = [
        sys.executable,
        "-m",
        "misclosure",
        "simulate",
        "mapping",
        "-o",
        str(tmp_path / "b"),
        "--set",
        "points=2000000",
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    process.stderr.readline()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=5) == -signal.SIGINT


def test_pictures(adjusted, found, small):
    assert adjusted.figure("sensor").startswith("<svg") and adjusted.figure("sensor") == adjusted.figure(
        "sensor-final-1"
    )
    assert found.figure("ledger") in found._repr_html_()
    assert adjusted.figure("check-plan") in adjusted._repr_html_()
    assert small.figure() in small._repr_html_() and "<svg" in small.figure()
    assert "<html" in found.run.report
    with pytest.raises(misclosure.errors.InputError, match="figure 'nothing': expected one of .*sensor-final-1"):
        adjusted.figure("nothing")


def test_saved_pictures_are_those_of_the_report(adjusted, tmp_path):
    adjusted.save(tmp_path / "run")
    written = (tmp_path / "run" / "figures" / "sensor-final-1.svg").read_text()
    assert adjusted.figure("sensor").removeprefix("<svg") in written


def test_results_are_never_written_over_a_block(small, adjusted, tmp_path):
    small.write(tmp_path / "block")
    with pytest.raises(misclosure.errors.InputError, match="is a block, whose measurements would be lost"):
        adjusted.save(tmp_path / "block")
    with pytest.raises(misclosure.errors.InputError, match="is a block"):
        small.write(tmp_path / "block")


def test_a_saved_model_is_used_again(adjusted, shutter, tmp_path):
    (tmp_path / "model.toml").write_text(adjusted.model)
    again = shutter.adjust(model=tmp_path / "model.toml")
    assert again.sigma0 == pytest.approx(adjusted.sigma0, rel=1e-9)


def test_failures_have_their_kinds(small):
    with pytest.raises(misclosure.errors.InputError, match="--add nothing: unknown effect `nothing`"):
        small.adjust(add="nothing")
    with pytest.raises(misclosure.errors.InputError, match="invalid value 'x' for '--datum"):
        small.adjust(datum="x")
    with pytest.raises(misclosure.errors.ModelError):
        small.adjust(datum="gnss")
    with pytest.raises(misclosure.errors.InputError, match="--significance 2"):
        small.diagnose(significance=2)
    with pytest.raises(TypeError, match="unexpected keyword argument 'nothing'"):
        small.improve(nothing=1)
    with pytest.raises(misclosure.errors.ScenarioError, match='no parameter "nothing"'):
        misclosure.Block.simulate("dike", nothing=1)
    with pytest.raises(misclosure.errors.InputError, match="neither a preset"):
        misclosure.Block.simulate("nothing")
    with pytest.raises(misclosure.errors.InputError, match="threads=0: expected"):
        small.adjust(threads=0)


def test_numbers_of_numpy_are_numbers(truth):
    plain = truth.inject("noise", px=0.25, seed=2)
    for number in (np.float64(0.25), np.float32(0.25)):
        assert (truth.inject("noise", px=number, seed=np.int64(2)).ties["x"] == plain.ties["x"]).all()


def test_threads_change_no_digit(small):
    one, two = small.adjust(threads=1, solver="native"), small.adjust(threads=2, solver="native")
    assert (one.residuals == two.residuals).all() and one.sigma0 == two.sigma0
