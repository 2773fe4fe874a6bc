"""tandem.Run: the same bits as the program's, snapshots, faults, and what is refused."""

import gc
import json
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import BUILD, ROOT

import tandem
from tandem import _native

HOLD, TRAJECTORY = "double_pendulum/hold.toml", "double_pendulum/trajectory.toml"


def bits(run, cycles):
    rows = []
    for _ in range(cycles):
        rows.append(b"".join(a.tobytes() for f in (run.state, run.sent, run.truth)
                             for a in f._arrays.values()))  # fmt: skip
        if not run.step():
            break
    return rows


def swing(run):
    """A law whose command depends on all that went before."""
    run.command.torque[:] = 3.0 * np.sin(40.0 * run.time_s) - 2.0 * run.state.velocity


def test_controllers_run_to_the_bits_of_the_program(config, log_file):
    """log_file is the same experiment, by `tandem run`."""
    state = tandem.Log(log_file)["state"]
    run = tandem.Run(config / TRAJECTORY, duration_s=2)
    seen = [(run.cycle, {f: run.state[f].copy() for f in state.fields}) for _ in run]
    assert run.over and run.phase == "shut-down" and not run.faults
    assert len(seen) == 2000 and run.cycle == seen[-1][0] + 1  # of the last command
    run.finish()
    assert run.phase == "done" and run.cycle == state.cycle[-1, 0]
    assert np.array_equal(run.state.position, state.position[-1])
    for cycle, fields in seen:
        for name, values in fields.items():
            assert np.array_equal(values, state[name][cycle], equal_nan=True), (cycle, name)


def test_command_acts_in_the_cycle_of_its_state(config):
    run = tandem.Run(config / HOLD, control="torque")
    cycle = run.cycle
    run.command.torque[:] = 0.01
    assert run.step() and run.cycle == cycle + 1
    assert run.sent.cycle[0] == cycle and run.sent.mode[0] == 3


def test_torque_moves_the_joint_its_way(config):
    for sign in (1.0, -1.0):
        run = tandem.Run(config / HOLD, control="torque")
        before = run.truth.position.copy()
        hold = run.command.torque.copy()  # begins with what is measured
        for _ in range(100):
            run.command.torque = hold + [0.5 * sign, 0.0]
            run.step()
        assert sign * (run.truth.position - before)[0] > 1e-4


def test_python_and_a_controller_cannot_both_have_a_joint(config):
    with pytest.raises(tandem.Error, match="joint1"):  # `hold` has it
        tandem.Run(config / HOLD, control={"joint1": "torque"})


def test_iteration_begins_with_the_state_that_there_is(config):
    run = tandem.Run(config / HOLD, control="position")
    first = run.cycle
    assert [s.cycle[0] for s, _ in zip(run, range(3))] == [first, first + 1, first + 2]
    run.step(10)
    assert run.cycle == first + 13  # zip() had taken a fourth


def test_saved_and_restored_it_goes_the_same_way(config):
    run = tandem.Run(config / HOLD, control="torque", seed=3)
    for _ in range(200):
        swing(run)
        run.step()
    swing(run)
    snapshot = run.save()
    once, command = bits(run, 300), run.command.torque.copy()
    run.restore(snapshot)
    assert np.array_equal(run.command.torque, command)  # as it stood
    assert bits(run, 300) == once
    other = tandem.Run(config / HOLD, control="torque", seed=3)
    other.restore(snapshot)
    assert bits(other, 300) == once
    assert not np.array_equal(np.frombuffer(once[0], np.uint8), np.frombuffer(once[299], np.uint8))


def test_rewound_from_its_end_it_runs_again(config):
    run = tandem.Run(config / TRAJECTORY, duration_s=0.2)
    begin = run.save()
    assert sum(1 for _ in run) == 200
    end = run.state.position.copy()
    with pytest.raises(tandem.Error, match="the run is over"):
        run.step()
    assert list(run) == [] and run.result["cycles"] == 200
    run.restore(begin)
    assert sum(1 for _ in run) == 200 and np.array_equal(run.state.position, end)


def test_seeds_differ_and_repeat(config):
    def path(seed):
        run = tandem.Run(config / "panda/hold.toml", seed=seed, duration_s=0.1)
        return np.array([s.position.copy() for s in run])

    assert np.array_equal(path(1), path(1))
    assert tandem.Run(config / HOLD, seed=7).seed == 7


def test_many_cycles_in_a_step_are_single_ones(config):
    one, many = (tandem.Run(config / TRAJECTORY) for _ in range(2))
    for _ in range(250):
        one.step()
    many.step(250)
    assert bits(one, 5) == bits(many, 5)


def test_what_is_no_number_is_refused_before_it_is_commanded(config):
    run = tandem.Run(config / HOLD, control="torque")
    cycle = run.cycle
    run.command.torque[1] = np.nan
    with pytest.raises(ValueError, match="torque_Nm: of joint2 is not finite in cycle"):
        run.step()
    with pytest.raises(ValueError, match="joint2"):
        next(iter(run)), next(iter(run))
    assert run.cycle == cycle and not run.faults
    run.command.torque[1] = 0.0
    assert run.step() and run.cycle == cycle + 1  # it goes on


def test_shapes_and_names_are_checked(config):
    run = tandem.Run(config / HOLD, control="torque")
    with pytest.raises(ValueError, match=r"command.torque: has the shape \(3,\), wanted \(2,\)"):
        run.command.torque = [1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match="command.torque: of joint2 is not finite"):
        run.command.torque = [1.0, np.inf]
    with pytest.raises(ValueError):
        run.command.torque[:] = np.zeros(3)
    with pytest.raises(AttributeError, match="did you mean 'torque'"):
        run.command.torqe = 1.0
    with pytest.raises(tandem.UnknownName, match="did you mean 'velocity_rad_s'"):
        run.state["velocty_rad_s"]
    with pytest.raises(tandem.Error, match="cannot be written"):
        run.state.position = 0.0
    with pytest.raises(ValueError):
        run.state.position[0] = 0.0
    with pytest.raises(ValueError):
        run.command.mode[0] = 1
    with pytest.raises(KeyError, match="did you mean 'joint1'"):
        run.joint("jiont1")
    with pytest.raises(ValueError, match="cycles: 0"):
        run.step(0)
    assert run.state.units["torque"] == "Nm or N" and run.joint("joint2") == 1


def test_values_of_any_layout_and_number_are_taken_and_others_named(config):
    run = tandem.Run(config / HOLD, control="torque")
    wide = np.arange(8.0).reshape(4, 2) / 100.0
    for values in (wide[::-1][0], wide.T[:, 3], wide[3].astype(np.float32).astype(float), [0.06, 0.07]):
        run.command.torque = values
        assert np.allclose(run.command.torque, [0.06, 0.07], rtol=0, atol=1e-8)
    for values in (np.array([1, 0], np.int8), np.array([True, False]), (1, 0)):
        run.command.torque = values
        assert run.command.torque.dtype == np.float64 and list(run.command.torque) == [1.0, 0.0]
    cycle = run.cycle
    for bad in ("much", ["a", "b"], [1j, 0], [[1.0], [1.0, 2.0]], {"joint1": 1.0}, None, object(),
                np.array(["2026-01-01", "2026-01-02"], "M8[D]")):  # fmt: skip
        with pytest.raises(ValueError, match="command.torque: "):
            run.command.torque = bad
    for bad in (np.zeros((2, 1)), np.zeros((1, 2)), np.zeros(0), np.zeros(1)):
        with pytest.raises(ValueError, match="command.torque: has the shape"):
            run.command.torque = bad
    assert list(run.command.torque) == [1.0, 0.0]
    assert run.step() and run.cycle == cycle + 1 and not run.faults


def test_observers_do_not_command(config):
    run = tandem.Run(config / HOLD)
    with pytest.raises(tandem.Error, match="cannot be written"):
        run.command.torque = 0.0


@pytest.mark.parametrize(
    "arguments, kind, words",
    [
        ({"control": "torqe"}, tandem.UnknownName, "did you mean 'torque'"),
        ({"control": {"jiont1": "torque"}}, KeyError, "did you mean 'joint1'"),
        ({"hal": "can"}, tandem.Error, "Python steps a robot that is simulated in its own process"),
        ({"hal": "dds"}, tandem.Error, "simulated in its own process"),
        ({"hal": "cna"}, tandem.Error, "one of sim, can"),
        ({"duration_s": -1.0}, ValueError, "duration_s: -1.0, wanted above 0 to 1e6"),
        ({"duration_s": 0}, ValueError, 'or "endless"'),
        ({"duration_s": "long"}, ValueError, "duration_s: 'long', wanted above 0"),
        ({"hal": "ethercat"}, tandem.Error, "simulated in its own process"),
        ({"seed": 2**63}, ValueError, "seed: 9223372036854775808, wanted 0 to"),
        ({"on_fault": "laugh"}, tandem.Error, "one of end, wait"),
        ({"scenario": "no/such.toml"}, FileNotFoundError, "no/such.toml"),
        ({"seed": -1}, ValueError, "seed: -1, wanted 0 to"),
        ({"seed": "1"}, TypeError, "str"),
        ({"rate": -1.0}, ValueError, "rate: -1.0, wanted 0, or 0.01 to 1000"),
        ({"rate": float("nan")}, ValueError, "rate: nan"),
        ({"delay_cycles": 1001}, ValueError, "delay_cycles: 1001, wanted 0 to 1000"),
        ({"control": ""}, ValueError, "control: '', wanted None, a mode, or a mode by joint"),
        ({"control": {"joint1": 3}}, ValueError, "control: "),
        ({"control": 3}, ValueError, "control: 3"),
    ],
)
def test_arguments_that_do_not_fit(config, arguments, kind, words):
    with pytest.raises(kind, match=words):
        tandem.Run(config / HOLD, **arguments)


def test_files_that_do_not_fit(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.toml"):
        tandem.Run(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text('robot = 3\nduration = "long"\n')
    with pytest.raises(tandem.Error) as error:
        tandem.Run(tmp_path / "bad.toml")
    assert len(str(error.value).splitlines()) > 1  # every error, a line each


def test_bundled_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert tandem.Run("double_pendulum/hold", duration_s=0.1).joints == ["joint1", "joint2"]
    assert tandem.Model("double_pendulum").nq == 2
    with pytest.raises(tandem.Error, match="did you mean 'double_pendulum/hold'"):
        tandem.Run("double_pendulum/hlod")
    with pytest.raises(tandem.Error, match="did you mean 'panda'"):
        tandem.Model("padna")


def test_pushes_and_faults(config):
    run = tandem.Run(config / HOLD, control="position", on_fault="wait")
    run.step(50)
    before = run.truth.position.copy()
    run.inject("push", joint="joint2", force_N=[5.0, 0, 0], for_s=0.05)
    run.step(60)
    assert np.abs(run.truth.position - before).max() > 1e-5
    with pytest.raises(tandem.Error, match="did you mean 'joint2'"):
        run.inject("push", joint="jiont2", force_N=[1, 0, 0])
    run.inject("encoder_freeze", joint="joint1")
    run.stop(category=1)
    run.step(5)
    assert run.phase == "faulted" and run.faults and "stop" in run.faults[0]["text"]
    assert sum(1 for _, _ in zip(range(20), run)) == 20  # it goes on, as its rules say
    run.finish()
    assert run.over and run.phase == "done" and list(run) == []


def test_a_fault_ends_the_run_by_default(config):
    run = tandem.Run(config / HOLD, control="torque")
    run.stop(0)
    assert run.step() is False and run.over
    run.finish()
    assert run.phase == "done"
    assert run.result["fault_log"][0]["category"] == "category0"
    assert run.result["ended"] == "by a fault" and len(run.result["faults"]) == 1


def test_arrays_outlive_their_run(config):
    run = tandem.Run(config / HOLD, control="torque")
    state, torque = run.state, run.command.torque
    position = state.position
    kept = position.copy()
    del run, state
    gc.collect()
    torque[:] = 1.0
    assert np.array_equal(position, kept)


def test_runs_are_freed(config):
    def resident_kB():
        with open("/proc/self/status") as status:
            return int(next(line for line in status if line.startswith("VmRSS")).split()[1])

    def many(count):
        for _ in range(count):
            tandem.Run(config / HOLD, control="torque").step(10)
        gc.collect()
        return resident_kB()

    begun = many(10)
    assert many(40) - begun < 40 * 150  # each has 350 kB


def test_two_runs_go_their_own_ways(config):
    alone = tandem.Run(config / TRAJECTORY)
    wanted = bits(alone, 100)
    one, other = tandem.Run(config / TRAJECTORY), tandem.Run(config / "panda/hold.toml", control="torque")
    seen = []
    for _ in range(100):
        seen += bits(one, 1)
        other.step()
    assert seen == wanted


def test_runs_in_threads(config):
    """Opened and stepped at once; each as if it were alone."""
    alone = tandem.Run(config / TRAJECTORY)
    alone.step(1500)
    wanted, found = alone.truth.position.copy(), []

    def work():
        run = tandem.Run(config / TRAJECTORY)
        run.step(1500)
        found.append(run.truth.position.copy())

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and all(np.array_equal(one, wanted) for one in found)


@pytest.mark.parametrize(
    "call",
    [tandem.Run.save, lambda run: run.result, lambda run: run.ask("controller.list")],
)
def test_one_thread_at_a_time(config, call):
    run = tandem.Run(config / HOLD, control="position", duration_s=1e5)
    errors, stop = [], threading.Event()

    def other():
        while not stop.is_set():
            try:
                call(run)
            except tandem.Error as error:
                errors.append(str(error))
                return

    thread = threading.Thread(target=other)
    thread.start()
    while thread.is_alive():
        try:
            run.step(2000)
        except tandem.Error as error:
            errors.append(str(error))
            stop.set()
            break
    thread.join()
    assert "another thread is in this run" in errors[0]
    assert run.step()


def test_what_the_program_warns_of_is_a_warning(config, recwarn):
    tandem.Run(config / HOLD), tandem.Run(config / "panda/hold.toml", control="torque")
    assert not recwarn.list
    with pytest.warns(UserWarning) as told:
        run = tandem.Run(config / "double_pendulum_interpolated/trajectory.toml")
    assert [str(one.message) for one in told] == run.warnings and len(run.warnings) == 2
    assert "'drive_1': what the drive does when the connection is lost" in run.warnings[0]
    assert all(one.filename == __file__ for one in told)
    program = subprocess.run(
        [BUILD / "bin/tandem", "run", run.experiment, "--duration", "0.1", "--no-socket", "--no-dds",
         "--quiet", "--no-log"], check=True, capture_output=True, text=True,
    )  # fmt: skip
    for text in run.warnings:
        assert f"warning: {text}\n" in program.stderr


def test_ctrl_c_is_heard_and_the_run_goes_on(config):
    run = tandem.Run(config / HOLD, control="position", duration_s=1e6)
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        run.step(10**9)
    cycle = run.cycle
    assert run.step() and run.cycle == cycle + 1
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in run:
            pass
    assert run.step() and not run.faults


def scenario_with_a_push(folder):
    file = folder / "push.toml"
    file.write_text('[[fault]]\nkind = "push"\njoint = "joint2"\nforce_N = [1, 0, 0]\nfor_s = 0.1\n')
    return file


def test_snapshots_of_others_are_refused(config, tmp_path):
    run = tandem.Run(config / HOLD, control="torque")
    run.step(20)
    own = run.save()
    wanted = bits(run, 20)
    flipped = bytearray(own)
    flipped[len(own) // 2] ^= 1
    run.restore(own)
    for bad in (b"", b"tandem-run1", own[:-1], own + b"x", own[1:], bytes(flipped)):
        with pytest.raises(ValueError, match="none of Run.save"):
            run.restore(bad)
    with pytest.raises(tandem.Error):
        run.restore(tandem.Run(config / "panda/hold.toml", control="torque").save())
    with pytest.raises(tandem.Error, match="'controller"):
        run.restore(tandem.Run(config / HOLD).save())
    with pytest.raises(tandem.Error, match="other controllers"):
        run.restore(tandem.Run(config / HOLD, control="position").save())
    for no_bytes in ("abc", 3, None):
        with pytest.raises(ValueError, match="snapshot: is of the type"):
            run.restore(no_bytes)
    run.restore(bytearray(own))
    other = tandem.Run(config / HOLD, control="torque", scenario=scenario_with_a_push(tmp_path))
    try:  # as far as it fits; else the run is as it was
        run.restore(other.save())
        run.restore(own)
    except tandem.Error:
        pass
    assert bits(run, 20) == wanted


def changed(config, tmp_path, text="", robot=None):
    """hold.toml with more text, and another robot.toml beside it."""
    folder = config / "double_pendulum"
    hold = (folder / "hold.toml").read_text().replace("robot.toml", str(folder / "robot.toml"))
    if robot is not None:
        other = tmp_path / "robot.toml"
        lines = (folder / "robot.toml").read_text().replace('urdf = "', f'urdf = "{folder}/')
        other.write_text(lines.replace(*robot))
        assert robot[0] in lines
        hold = hold.replace(str(folder / "robot.toml"), str(other))
    file = tmp_path / "changed.toml"
    file.write_text(text.format(hold=hold) if "{hold}" in text else hold + text)
    return file


@pytest.mark.parametrize(
    "text, options, what",
    [
        ("\n[sim.link.link2]\nmass_kg = 3.0\n", {}, "sim.link"),
        ("\n[sim.joint.joint1]\nfriction_Nm = 1.0\n", {}, "sim.joint"),
        ('\n[sim]\nintegrator = "rk4"\n', {}, "sim.integrator"),
        ("period_ns = 2000000\n{hold}", {}, "period_ns"),
        ("", {"seed": 9}, "seed"),
        ("", {"on_fault": "wait"}, "on_fault"),
        ("", {"delay_cycles": 2}, "delay_cycles"),
        ("", {"kernel_variant": "baseline"}, "kernels"),
    ],
)
def test_a_snapshot_names_what_is_not_the_same(config, tmp_path, text, options, what):
    snapshot = tandem.Run(config / HOLD, control="torque").save()
    other = tandem.Run(changed(config, tmp_path, text), control="torque", **options)
    before = other.save()
    with pytest.raises(tandem.Error, match=f"is of another run: '{what}' is not the same"):
        other.restore(snapshot)
    assert other.save() == before
    with pytest.raises(tandem.Error, match=f"'{what}'"):
        tandem.Run(config / HOLD, control="torque").restore(before)


def test_a_snapshot_of_another_robot_file_is_refused(config, tmp_path):
    snapshot = tandem.Run(config / HOLD, control="torque").save()
    robot = ("[model]", "# another\n[model]")
    other = tandem.Run(changed(config, tmp_path, robot=robot), control="torque")
    with pytest.raises(tandem.Error, match="another run: 'robot'"):
        other.restore(snapshot)


def test_a_snapshot_fits_where_nothing_that_matters_differs(config, tmp_path):
    run = tandem.Run(config / HOLD, control="torque", duration_s=1)
    run.step(900)
    snapshot = run.save()
    wanted = bits(run, 99)
    quiet = changed(config, tmp_path, "\n# a remark\n[report]\n[log]\nfolder = \"elsewhere\"\n")
    other = tandem.Run(quiet, control="torque", duration_s=2)
    other.restore(snapshot)
    assert bits(other, 99) == wanted
    assert 1 + sum(1 for _ in other) == 1001  # the duration is its own


def test_tracking_error_is_none_where_no_position_was_wanted(config):
    run = tandem.Run(config / "panda/hold.toml", control="torque")
    model = tandem.Model(run.robot_file)
    for state, _ in zip(run, range(300)):
        run.command.torque[:] = model.bias(state.position, np.zeros(7)) - 2.0 * state.velocity
    rows = run.result["joints"]
    assert all(row["rms_tracking_error_rad"] is None for row in rows.values()), rows
    assert all(row["max_tracking_error_rad"] is None for row in rows.values())
    run.command.position[3] = run.state.position[3] + 0.1  # what it wants by other means
    run.step(10)
    rows = run.result["joints"]
    assert rows.pop("panda_joint4")["max_tracking_error_rad"] > 0.05
    assert all(row["rms_tracking_error_rad"] is None for row in rows.values())


def stopped(config, **options):
    run = tandem.Run(config / HOLD, control="torque", on_fault="wait", **options)
    run.step(50)
    run.stop(1)
    run.step(20)
    assert run.phase == "faulted"
    return run


def test_after_a_reset_start_gives_the_robot_back(config):
    run = stopped(config, duration_s=1)
    with pytest.raises(tandem.Error, match="phase 'faulted', wanted 'held'"):
        run.start()
    run.reset_faults()
    while run.phase != "held":
        run.step()
    run.start()
    assert np.array_equal(run.command.torque, run.state.torque)
    run.command.torque[:] = hold = run.command.torque.copy()
    assert run.step() and run.phase == "running"
    with pytest.raises(tandem.Error, match="lead already"):
        run.start()
    run.step(150)
    assert np.allclose(run.sent.torque, hold)
    assert 0 < sum(1 for _ in run) < 1000 and run.over  # and ends as planned
    assert run.result["cycles"] == 1000 and run.result["ended"] == "as planned"


def test_a_loop_ends_though_the_run_waits(config):
    run = stopped(config, duration_s=0.5)
    assert sum(1 for _ in run) < 500 and not run.over
    run.reset_faults()
    run.step(2000)
    assert run.phase == "held" and list(run) == []


def test_a_command_that_nobody_obeys_is_told(config, recwarn):
    run = stopped(config)
    run.step(5)
    assert not recwarn.list
    run.command.torque[0] = 0.5
    with pytest.warns(RuntimeWarning, match="phase 'faulted': its command is not obeyed"):
        run.step()


def test_what_is_for_other_joints_is_told_as_a_plugins(config, tmp_path):
    text = "\n[controller.parameters]\njoints = [\"joint2\"]\n"
    run = tandem.Run(changed(config, tmp_path, text), control={"joint1": "torque"})
    run.step(5)
    run.command.torque[0] = 0.1
    run.step(5)
    assert not run.faults
    run.command.position[1] = np.nan
    sent = run.sent.position[1]
    run.step(5)
    assert [f["joint"] for f in run.faults] == ["joint2"] and run.sent.position[1] == sent
    assert "python" in str(run.result["fault_log"][0])
    assert run.phase == "running"


def test_whole_objects_cannot_be_assigned(config, log_file):
    run = tandem.Run(config / HOLD, control="torque")
    with pytest.raises(tandem.Error, match=r"Run.command: cannot be set \(write into it: run.command"):
        run.command = np.zeros(2)
    with pytest.raises(tandem.Error, match="Run.sede: cannot be set"):
        run.sede = 3
    with pytest.raises(tandem.Error, match="Parameters.kp: cannot be set"):
        tandem.Run(config / HOLD).controllers["hold"].kp = 3
    model = tandem.Model(run.robot_file)
    with pytest.raises(tandem.Error, match="Model.mass_kg: cannot be set"):
        model.mass_kg = 3
    with pytest.raises(tandem.Error, match="cannot be deleted"):
        del model.nq
    log = tandem.Log(log_file)
    for target in (log, log["state"], log["state"].position):
        with pytest.raises(tandem.Error, match="cannot be set"):
            target.joints = []
    for array in (log["state"].time_s, log["state"].position.values, run.limits["max_torque_Nm"]):
        with pytest.raises(ValueError):
            array[0] = 99


def test_the_result_says_what_of_the_plant_is_other(config):
    plant = tandem.Run(config / "panda/payload.toml").result["plant"]
    assert plant == ["payload box, 1.6 kg on panda_hand, from 5 s to 9 s"]
    assert tandem.Run(config / "panda/hold.toml").result["plant"] is None


def test_the_weight_has_what_the_robot_carries(config, tmp_path):
    def weight_N(more):
        file = tmp_path / "stand.toml"
        file.write_text(f'robot = "{config}/coman/robot.toml"\nposture = "stand"\nduration_s = 1.0\n'
                        f'[[controller]]\nplugin = "hold"\n{more}')  # fmt: skip
        run = tandem.Run(file, build=False)
        assert sum(1 for _ in run) == 1000
        ground = run.result["ground"]
        assert ground["mean_vertical_force_N"] == pytest.approx(ground["weight_N"], rel=0.01)
        return ground["weight_N"]

    box = "[[sim.payload]]\nname = 'box'\nlink = 'DWYTorso'\nmass_kg = 3\n"
    alone = weight_N("")
    assert weight_N(box) - alone == pytest.approx(3 * 9.81, abs=0.01)
    assert 5.0 < weight_N(box + "from_s = 1.5\n") - alone < 25.0  # for a part of the run


def test_a_payload_is_injected(config):
    runs = [tandem.Run(config / "panda/hold.toml") for _ in range(2)]
    runs[1].inject("payload", site="hand", mass_kg=2.0)
    for run in runs:
        run.step(1000)
    assert abs(runs[1].state.torque - runs[0].state.torque).max() > 5.0
    with pytest.raises(tandem.Error, match="hand"):
        runs[0].inject("payload", site="hadn", mass_kg=2.0)


def test_figures_are_those_of_the_program(config, tmp_path):
    run = tandem.Run(config / "coman/squat.toml", duration_s=1)
    assert run.result["ended"] is None
    assert sum(1 for _ in run) == 1000
    run.finish()
    text = subprocess.run(
        [BUILD / "bin/tandem", "run", config / "coman/squat.toml", "--duration", "1", "--json", "-",
         "--no-socket", "--no-dds", "--quiet", "--log", tmp_path],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    theirs, ours = json.loads(text), run.result
    assert len(ours) >= 15 and ours["ground"] and ours["base"] and ours["work"]
    for name, value in ours.items():
        assert same(value, theirs[name]), (name, value, theirs[name])


def same(one, other):
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    return one == other or (isinstance(one, float) and np.isclose(one, other, rtol=1e-5, atol=1e-12))


def test_after_the_end_nothing_is_asked(config):
    run = tandem.Run(config / HOLD, control="torque", duration_s=0.05)
    assert sum(1 for _ in run) == 50
    for ask in (run.reset_faults, run.stop, run.start, run.step,
                lambda: run.inject("encoder_freeze", joint="joint1")):  # fmt: skip
        with pytest.raises(tandem.Error, match="the run is over"):
            ask()
    assert run.result["ended"] == "as planned"


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda run: run.step(1.5), "cycles: 1.5, wanted a whole number from 1"),
        (lambda run: run.step(2**70), "wanted a whole number"),
        (lambda run: run.joint(3), "no such joint '3'"),
        (lambda run: run.inject("push", joint="joint1", force_N=[0, float("nan"), 0]), "force_N: .* is not finite"),
        (lambda run: run.inject("push", joint=None), "joint: None is no number"),
        (lambda run: run.inject("push", **{"a b": 1}), "'a b' is no key"),
        (lambda run: setattr(run.command, "torque", ["1", "2"]), "command.torque: is no array of numbers"),
        (lambda run: setattr(run.command, "torque", [1j, 0]), "command.torque: is no array of numbers"),
    ],
)  # fmt: skip
def test_messages_speak_of_what_was_given(config, call, words):
    run = tandem.Run(config / HOLD, control="torque")
    with pytest.raises((ValueError, KeyError), match=words) as error:
        call(run)
    assert "_native" not in str(error.value)


def test_a_conflict_advises_what_helps(config):
    with pytest.raises(tandem.Error, match=r"joints = \[...\]") as error:
        tandem.Run(config / HOLD, control={"joint1": "torque"})
    assert "active = false" not in str(error.value)


def test_no_object_is_without_its_run(log_file):
    for kind in (_native.Kernels, _native.Run, _native.LogFile):
        with pytest.raises(TypeError):
            kind.__new__(kind)
    assert tandem.__version__


def test_model_and_run_agree(config):
    """Gravity compensation by the model holds the arm: signs, units and order are the same."""
    run = tandem.Run(config / "panda/hold.toml", control="torque")
    model = tandem.Model(run.robot_file)
    order = model.indices(run.joints)
    begin = run.truth.position.copy()
    q = np.empty(model.nq)
    for state, _ in zip(run, range(500)):
        q[order] = state.position
        run.command.torque = model.bias(q, np.zeros(model.nv))[order]
    assert np.abs(run.truth.position - begin).max() < 0.02


def test_estimate_is_there_where_the_experiment_wants_one(config):
    assert tandem.Run(config / HOLD).estimate is None
    run = tandem.Run(config / "coman/hand.toml", build=False)
    run.step(300)
    assert run.estimate.units and run.estimate.cycle[0] == run.cycle
    assert any(array.any() for name, array in run.estimate._arrays.items() if "torque" in name)


def test_a_joint_that_no_controller_has_is_led_beside_them(config, tmp_path):
    experiment = tmp_path / "one.toml"
    experiment.write_text(f"""
robot = "{config}/double_pendulum/robot.toml"
posture = "ready"
duration_s = 1.0
[[controller]]
plugin = "joint_trajectory"
[controller.parameters]
joints = ["joint1"]
[[controller.parameters.waypoint]]
time_s = 0.5
position_rad = [-0.3]
""")
    run = tandem.Run(experiment, control={"joint2": "position"})
    begin = run.state.position.copy()
    for state in run:
        run.command.position[1] = begin[1] + 0.1 * min(1.0, (run.time_s - 1.2) / 0.5)
    assert np.allclose(run.sent.position, [-0.3, begin[1] + 0.1], rtol=0, atol=1e-12)
    assert np.allclose(run.state.position, run.sent.position, rtol=0, atol=0.05)  # springs yield


def test_python_ends_while_a_thread_steps():
    """A thread that wants the interpreter back from one that ends would end the process."""
    text = f"""
import tandem, threading, time
run = tandem.Run({str(ROOT / "config" / HOLD)!r}, control="position", duration_s=1e6)
threading.Thread(target=lambda: run.step(10**9), daemon=True).start()
time.sleep(0.2)
"""
    ended = subprocess.run([sys.executable, "-B", "-c", text], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


def test_python_ends_while_a_thread_steps_again_and_again():
    """Its next step begins when the interpreter ends: an error would be printed amid that."""
    text = f"""
import tandem, threading, time
run = tandem.Run({str(ROOT / "config" / HOLD)!r}, control="position", duration_s=1e6)
threading.Thread(target=lambda: [run.step(1) for _ in iter(int, 1)], daemon=True).start()
time.sleep(0.2)
"""
    ended = subprocess.run([sys.executable, "-B", "-c", text], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")
