"""A run's log: the program's, bit for bit; what it refuses; how it ends."""

import gc
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import BUILD, ROOT

import tandem

HOLD, TRAJECTORY = "double_pendulum/hold.toml", "double_pendulum/trajectory.toml"


def python(text, **environment):
    return subprocess.run(
        [sys.executable, "-B", "-c", f"import tandem, os\nHOLD = {str(ROOT / 'config' / HOLD)!r}\n{text}"],
        capture_output=True, text=True, timeout=60, env={**os.environ, **environment},
    )  # fmt: skip


def test_it_is_the_log_of_the_program(config, log_file, tmp_path):
    """log_file is the same experiment, by `tandem run`."""
    run = tandem.Run(config / TRAJECTORY, duration_s=2, log=tmp_path / "a.mcap")
    assert run.log == str(tmp_path / "a.mcap")
    for _ in run:
        pass
    run.finish()
    mine, its = tandem.Log(run.log), tandem.Log(log_file)
    assert mine.data_sha256 == its.data_sha256 and not mine.truncated
    assert mine.channels == its.channels and mine.events == its.events
    for channel in ("state", "command", "truth"):
        for field in its[channel].fields:
            assert np.array_equal(mine[channel][field].values, its[channel][field].values,
                                  equal_nan=True), (channel, field)  # fmt: skip
    assert mine.configuration == its.configuration and mine.info["seed"] == its.info["seed"]
    diff = subprocess.run([BUILD / "bin/tandem", "log", "diff", run.log, log_file])
    assert diff.returncode == 0


def test_it_says_that_python_led_and_what_it_commanded(config, tmp_path):
    run = tandem.Run(config / HOLD, control="torque", log=tmp_path / "a.mcap")
    told = []
    for i in range(50):
        run.command.torque = [0.01 * i, 0.02]
        run.step()
        told.append((run.sent.cycle[0], run.sent.torque.copy()))
    run.close()
    log = tandem.Log(run.log)
    assert "python - -" in log.info["controllers"]
    command = log["command"]
    for cycle, torque in told:
        row = int(np.flatnonzero(command.cycle[:, 0] == cycle)[0])
        assert np.array_equal(command.torque.values[row], torque)


def test_a_folder_gets_the_next_free_number(config, tmp_path):
    names = []
    for _ in range(2):
        with tandem.Run(config / HOLD, log=tmp_path / "logs") as run:
            run.step(10)
            names.append(run.log)
    assert names == [str(tmp_path / f"logs/double_pendulum-hold-00{n}.mcap") for n in (1, 2)]
    assert all(len(tandem.Log(name)["state"]) > 10 for name in names)
    (tmp_path / "odd.mcap").mkdir()  # a folder stays one
    with tandem.Run(config / HOLD, log=tmp_path / "odd.mcap") as run:
        assert run.log == str(tmp_path / "odd.mcap/double_pendulum-hold-001.mcap")
    assert tandem.Run(config / HOLD).log is None


def test_what_is_there_is_not_overwritten(config, tmp_path):
    file = tmp_path / "a.mcap"
    file.write_text("mine\n")
    with pytest.raises(tandem.Error, match="a.mcap.*cannot make the log.*exists"):
        tandem.Run(config / HOLD, log=file)
    assert file.read_text() == "mine\n"
    file.unlink()
    (tmp_path / "elsewhere").write_text("mine\n")
    file.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(tandem.Error, match="a.mcap"):
        tandem.Run(config / HOLD, log=file)
    assert (tmp_path / "elsewhere").read_text() == "mine\n"


def test_places_that_are_none(config, tmp_path):
    for place in ("", "a\0b.mcap"):
        with pytest.raises(ValueError, match="log: .* is no name"):
            tandem.Run(config / HOLD, log=place)
    with pytest.raises(TypeError):
        tandem.Run(config / HOLD, log=3)
    (tmp_path / "file").write_text("")
    for place in ("file/a.mcap", "file"):
        with pytest.raises(tandem.Error, match="the log"):
            tandem.Run(config / HOLD, log=tmp_path / place)
    with pytest.raises(tandem.Error, match="jiont1"):  # found before there is a log
        tandem.Run(config / HOLD, control={"jiont1": "torque"}, log=tmp_path / "b.mcap")
    assert not (tmp_path / "b.mcap").exists()


def test_a_full_disk_is_told_and_the_run_goes_on(config, tmp_path):
    experiment = tmp_path / "full.toml"
    text = (config / HOLD).read_text().replace('"robot.toml"', f'"{config}/double_pendulum/robot.toml"')
    experiment.write_text(text + "\n[log]\nkeep_free_MB = 1e9\n")
    with pytest.raises(tandem.Error, match="the disk is too full for the log"):
        tandem.Run(experiment, log=tmp_path / "a.mcap")
    ended = python("""
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
run = tandem.Run(HOLD, duration_s=60, log=os.environ["PLACE"])
resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, resource.RLIM_INFINITY))
steps = 1
while run.step(): steps += 1
try:
    run.finish()
except tandem.Error as error:
    print(steps, run.phase, error)
""", PLACE=str(tmp_path / "b.mcap"))  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    steps, phase, *words = ended.stdout.split(maxsplit=2)
    assert (steps, phase) == ("60000", "done"), ended.stdout
    assert "the log lost" in words[0] and "b.mcap" in words[0]


def test_a_run_with_a_log_goes_forward_only(config, tmp_path):
    run = tandem.Run(config / HOLD, control="torque", log=tmp_path / "a.mcap")
    run.step(20)
    snapshot, cycle = run.save(), run.cycle
    run.step(20)
    with pytest.raises(tandem.Error, match="goes forward only"):
        run.restore(snapshot)
    assert run.cycle == cycle + 20 and run.step()  # it goes on
    run.finish()
    log = tandem.Log(run.log)
    assert np.array_equal(log["state"].cycle[:, 0], np.arange(len(log["state"])))
    other = tandem.Run(config / HOLD, control="torque")
    other.restore(snapshot)
    assert other.cycle == cycle


def test_a_closed_run_is_stepped_no_more(config, tmp_path):
    for log in (None, tmp_path / "a.mcap"):
        run = tandem.Run(config / HOLD, control="torque", log=log)
        run.step(5)
        run.close()
        for call in (run.step, lambda: run.inject("push"), lambda: run.ask("controller.list"),
                     lambda: run.restore(b"")):  # fmt: skip
            with pytest.raises(tandem.Error, match="the run is closed"):
                call()
        assert run.over and list(run) == []
        run.close(), run.finish()  # nothing more to do
        run.state.position.copy()
    assert len(tandem.Log(run.log)["state"]) > 5


def test_an_exception_in_the_loop_leaves_a_whole_log(config, tmp_path):
    with pytest.raises(ZeroDivisionError):
        with tandem.Run(config / HOLD, control="torque", log=tmp_path / "a.mcap") as run:
            begin = run.cycle
            for state in run:
                if run.cycle == begin + 300:
                    1 / 0
    log = tandem.Log(tmp_path / "a.mcap")
    assert not log.truncated and log["state"].cycle[-1, 0] == begin + 299


def test_a_run_that_nobody_keeps_ends_its_log(config, tmp_path):
    run = tandem.Run(config / HOLD, log=tmp_path / "a.mcap")
    run.step(5)
    kept = run.state.position
    del run
    gc.collect()
    assert not tandem.Log(tmp_path / "a.mcap").truncated
    assert np.isfinite(kept).all()
    ended = python("run = tandem.Run(HOLD, log=os.environ['PLACE'])\nrun.step(5)\nraise SystemExit(3)",
                   PLACE=str(tmp_path / "b.mcap"))  # fmt: skip
    assert ended.returncode == 3 and ended.stderr == ""
    assert not tandem.Log(tmp_path / "b.mcap").truncated


def test_a_forked_process_leaves_the_log_to_its_parent(config, tmp_path):
    ended = python("""
run = tandem.Run(HOLD, log=os.environ["PLACE"])
run.step(5)
child = os.fork()
if child == 0:
    try:
        run.step(5000)
    except tandem.Error as error:
        assert "another process" in str(error), error
        del run
        os._exit(7)
    os._exit(1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
run.step(5)
run.finish()
""", PLACE=str(tmp_path / "a.mcap"))  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    log = tandem.Log(tmp_path / "a.mcap")
    assert not log.truncated
    assert np.array_equal(log["state"].cycle[:, 0], np.arange(len(log["state"])))
