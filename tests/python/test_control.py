"""Parameters, signals, inputs, words and joints of a run, from Python; and what is refused."""

import math
import os
import re

import numpy as np
import pytest
from conftest import BUILD

import tandem

JOG, FOLLOW = "double_pendulum/jog.toml", "double_pendulum/follow.toml"
PENDULUM = "double_pendulum/robot.toml"


def experiment(folder, config, text):
    """On the double pendulum, beside nothing else."""
    file = folder / "experiment.toml"
    file.write_text(f'robot = "{config}/{PENDULUM}"\nposture = "ready"\nduration_s = 5.0\n{text}')
    return file


@pytest.fixture
def jog(config, tmp_path):
    """A lower joint that waits for its rate."""
    return experiment(tmp_path, config, """
[[controller]]
plugin = "jog"
[controller.parameters]
joints = ["joint2"]
timeout_s = 1.0
""")  # fmt: skip


@pytest.fixture
def squat(config):
    return tandem.Run(config / "coman/squat.toml", build=False, duration_s=3)


def test_a_parameter_is_set_in_this_cycle_and_logged(config, tmp_path):
    run = tandem.Run(config / "coman/squat.toml", build=False, log=tmp_path / "a.mcap")
    run.step(100)
    squat = run.controllers["squat"]
    facts = squat.facts["link_damping_Nms_rad"]
    assert facts["live"] and facts["unit"] and not squat.facts["cycles"]["live"]
    cycle, wanted = run.cycle, squat["link_damping_Nms_rad"] + 1.5
    run.controllers["squat"]["link_damping_Nms_rad"] = np.float64(wanted)
    assert squat["link_damping_Nms_rad"] == wanted and run.cycle == cycle
    run.close()
    said = [e for e in tandem.Log(run.log).events if e.kind == "parameter set"]
    assert [(e.cycle, "squat.link_damping_Nms_rad" in e.text) for e in said] == [(cycle, True)]


def test_a_parameter_is_part_of_snapshots_and_acts_as_in_the_program(squat):
    run = squat
    run.step(300)
    snapshot, before = run.save(), run.controllers["squat"]["link_damping_Nms_rad"]

    def path(value):
        run.restore(snapshot)
        if value is not None:
            run.controllers["squat"]["link_damping_Nms_rad"] = value
        run.step(200)
        return run.sent.torque.copy(), run.truth.position.copy()

    plain, same, other = path(None), path(before), path(before + 5.0)
    assert np.array_equal(plain, same) and not np.array_equal(plain[1], other[1])
    run.restore(snapshot)
    assert run.controllers["squat"]["link_damping_Nms_rad"] == before


def test_parameters_that_do_not_fit_change_nothing_and_are_named(squat):
    run, before = squat, dict(squat.controllers["squat"])
    parameters = run.controllers["squat"]
    for name, value, kind, words in (
        ("link_damping_Nms_rad", math.nan, ValueError, "link_damping_Nms_rad: nan is not finite"),
        ("link_damping_Nms_rad", np.array([1.0, np.inf]), ValueError, "link_damping_Nms_rad"),
        ("link_damping_Nms_rad", -1.0, tandem.Error, "squat.link_damping_Nms_rad.*out of range"),
        ("link_damping_Nms_rad", "much", tandem.Error, "squat.link_damping_Nms_rad"),
        ("link_damping_Nms_rad", [1.0, 2.0], tandem.Error, "squat.link_damping_Nms_rad"),
        ("link_dampin_Nms_rad", 1.0, tandem.Error, "did you mean 'link_damping_Nms_rad'"),
        ("cycles", 2, tandem.Error, "squat.cycles.*not live"),
    ):  # fmt: skip
        with pytest.raises(kind, match=words):
            parameters[name] = value
        with pytest.raises(kind, match=words):  # all or none
            parameters.update({"link_damping_Nms_rad": 3.0, name: value})
    with pytest.raises(TypeError):
        parameters["link_damping_Nms_rad"] = object()
    with pytest.raises(tandem.UnknownName, match="did you mean 'link_damping_Nms_rad'"):
        parameters["link_damping_Nms_rat"]
    with pytest.raises(KeyError, match="did you mean 'squat'"):
        run.controllers["squad"]
    assert dict(parameters) == before
    cycle = run.cycle
    assert run.step() and run.cycle == cycle + 1 and not run.faults


def test_signals_are_those_of_the_log(config, tmp_path):
    run = tandem.Run(config / "coman/squat.toml", build=False, log=tmp_path / "a.mcap")
    depth, seen = run.signals["squat"].depth, []
    assert run.signals["squat"].units["depth"] == "m"
    run.step()
    first = int(run.signals["squat"].cycle[0])
    for _ in range(1500):
        seen.append(depth[0])
        run.step()
    run.close()
    log = tandem.Log(run.log)
    column = log[next(c for c in log.channels if c.endswith("squat"))]
    row = int(np.flatnonzero(column.cycle[:, 0] == first)[0])
    assert np.array_equal(column["depth"].values[row : row + 1500, 0], seen)
    assert depth[0] > 0.001
    assert run.signals["squat.depth"][0] == depth[0]
    with pytest.raises(ValueError):
        depth[0] = 1.0
    with pytest.raises(tandem.UnknownName, match="did you mean 'depth'"):
        run.signals["squat.dept"]
    with pytest.raises(tandem.UnknownName, match="did you mean 'squat'"):
        run.signals["sqat"]


def test_signals_outlive_their_controller(squat):
    depth = squat.signals["squat.depth"]
    squat.step(10)
    squat.ask("controller.stop", name="squat")
    squat.ask("controller.unload", name="squat")
    assert "squat" not in squat.signals and "squat" not in squat.controllers
    squat.step(10)
    assert np.isfinite(depth).all()


def test_an_input_moves_the_joint_from_this_cycle_on(jog, config):
    run = tandem.Run(jog)
    run.step(200)
    run.input("rate", {"joint2": 0.4})
    cycle = run.cycle
    run.step()
    shown = run.ask("input.list")["inputs"][0]
    assert shown["fresh"] and shown["cycle"] == cycle and shown["values"] == {"joint2": 0.4}
    before = run.state.position[1]
    run.step(500)
    assert 0.1 < run.state.position[1] - before < 0.25
    run.step(1500)  # and no further than its time-out
    before = run.state.position[1]
    run.step(200)
    assert abs(run.state.position[1] - before) < 1e-3


def test_it_is_the_timeline_of_the_program(config, jog):
    """A sample from Python in the cycle in which the experiment's timeline gives one."""
    by_file = tandem.Run(config / JOG, seed=1)
    by_hand = tandem.Run(jog, seed=1)
    first = None
    for _ in range(1200):
        if first is None and by_file.ask("input.list")["inputs"][0]["fresh"]:
            first = by_file.ask("input.list")["inputs"][0]["cycle"]
        by_file.step()
    assert first is not None
    while by_hand.cycle < by_file.cycle:
        if by_hand.cycle == first:
            by_hand.input("rate", {"joint2": 0.4})
        by_hand.step()
    assert np.array_equal(by_file.sent.position, by_hand.sent.position)


def test_a_trajectory_leads_joints(config, tmp_path):
    run = tandem.Run(experiment(tmp_path, config, '[[controller]]\nplugin = "trajectory_follower"\n'))
    points = [{"after_s": 0.5, "position_rad": np.array([0.7, -0.3])}]
    with pytest.raises(tandem.Error, match="no sample is taken"):  # it would be lost
        run.input("trajectory", points)
    run.step()
    run.input("trajectory", points)
    run.step(1000)
    assert np.allclose(run.sent.position, [0.7, -0.3], rtol=0, atol=1e-9)
    for bad, words in (
        ([{"after_s": 0.5, "position_rad": [0.7]}], "trajectory.*way-point 1"),
        ([{"after_s": 0.5, "position_rad": [0.7, 99.0]}], "joint2: 99 is beyond its bounds"),
        ([{"after_s": 0.5}], "position_rad"),
        ({"joint1": 0.1}, "way-points"),
    ):
        with pytest.raises(tandem.Error, match=words):
            run.input("trajectory", bad)
    with pytest.raises(ValueError, match="position_rad: nan is not finite"):
        run.input("trajectory", [{"after_s": 0.5, "position_rad": [0.7, math.nan]}])
    run.step(100)
    assert np.allclose(run.sent.position, [0.7, -0.3], rtol=0, atol=1e-9)


def test_inputs_that_do_not_fit_are_named_and_the_run_goes_on(config, jog):
    run = tandem.Run(jog)
    run.step()
    for name, sample, kind, words in (
        ("rat", {"joint2": 0.1}, tandem.Error, "did you mean 'rate'"),
        ("rate", {"joint1": 0.1}, tandem.Error, "joint1"),
        ("rate", {"joint2": 1e9}, tandem.Error, r"joint2: 1e\+09 is beyond its bounds"),
        ("rate", {"joint2": math.inf}, ValueError, "joint2: inf is not finite"),
        ("rate", {"joint2": "fast"}, tandem.Error, "joint2: 'fast' is no finite number"),
        ("rate", {"joint2": [0.1, 0.2]}, tandem.Error, "no finite number"),
        ("rate", [{"after_s": 1.0, "position_rad": [0.1]}], tandem.Error, "not with way-points"),
        ("rate", 0.1, ValueError, "rate: wanted numbers by component"),
        ("rate", "joint2", ValueError, "rate: wanted numbers by component"),
    ):
        with pytest.raises(kind, match=words):
            run.input(name, sample)
    for _ in range(5000):  # a flood: the newest of a cycle counts
        run.input("rate", {"joint2": 0.2})
    assert run.step() and not run.faults
    with pytest.raises(tandem.Error, match="rate"):  # the timeline feeds it
        tandem.Run(config / JOG).input("rate", {"joint2": 0.1})


def test_an_input_that_is_not_finite_counts_as_refused(jog, config, tmp_path):
    run = tandem.Run(jog)
    run.step()
    for value in (math.nan, np.float64("inf"), np.array(-np.inf)):
        with pytest.raises(ValueError, match="joint2: -?(nan|inf) is not finite"):
            run.input("rate", {"joint2": value})
    shown = run.ask("input.list")["inputs"][0]
    assert shown["refused"] == 3 and shown["sequence"] == 0
    assert "joint2: '-inf' is no finite number" in shown["why"]
    run = tandem.Run(experiment(tmp_path, config, '[[controller]]\nplugin = "trajectory_follower"\n'))
    run.step()
    for point in ({"after_s": 0.5, "position_rad": [0.7, math.nan]},
                  {"after_s": math.nan, "position_rad": np.array([0.7, -0.3])}):  # fmt: skip
        with pytest.raises(ValueError, match="nan is not finite"):
            run.input("trajectory", [point])
    assert run.ask("input.list")["inputs"][0]["refused"] == 2


def test_commands_that_are_none(jog):
    run = tandem.Run(jog)
    for command in ("controller.lits", "controler.list"):
        with pytest.raises(tandem.Error, match="did you mean 'controller.list'"):
            run.ask(command)
    with pytest.raises(tandem.Error, match="nmae"):
        run.ask("controller.show", nmae="jog")
    for own in ("estop", "clock.pause", "run.stop"):  # stop() and finish() are these
        with pytest.raises(tandem.Error):
            run.ask(own)
    with pytest.raises(tandem.Error, match="no such controller library"):
        run.ask("controller.load", plugin="/no/such.so")
    run.finish()
    with pytest.raises(tandem.Error, match="done"):
        run.ask("controller.stop", name="jog")


def test_controllers_come_and_go(jog):
    run = tandem.Run(jog, duration_s=3)
    loaded = run.ask("controller.load", plugin="hold", name="upper", parameters={"joints": ["joint1"]})
    assert loaded["done"] and loaded["cycle"] == run.cycle
    started = run.ask("controller.switch", stop=["jog"], start=["upper"])
    assert started["active"] == ["upper"] and list(run.controllers) == ["jog", "upper"]
    before = run.state.position.copy()
    run.step(500)
    assert np.allclose(run.state.position, before, rtol=0, atol=0.02) and not run.faults


def test_a_joint_is_homed_and_its_controller_starts_then(config, tmp_path):
    text = (config / PENDULUM).read_text()
    homing = "homing = { method = 35, speed_rad_s = 0.5, acceleration_rad_s2 = 1.0, position_rad = 0.5 }\n"
    head, joint, posture = re.split(r"(?=\[\[joint\]\]\n|\[posture.ready\]\n)", text)
    both = 'names = ["joint1", "joint2"]\n'
    one, two = (joint.replace(both, f'name = "{name}"\n') for name in ("joint1", "joint2"))
    (tmp_path / "robot.toml").write_text(head + one.rstrip() + "\n" + homing + "\n" + two + posture)
    os.symlink(config / "double_pendulum/double_pendulum.urdf", tmp_path / "double_pendulum.urdf")
    (tmp_path / "hold.toml").write_text(
        'robot = "robot.toml"\nposture = "ready"\nduration_s = 5.0\n[[controller]]\nplugin = "hold"\n'
    )
    run = tandem.Run(tmp_path / "hold.toml", on_fault="wait")
    assert run.phase == "held"
    with pytest.raises(tandem.Error, match="joint1"):
        run.ask("controller.start")
    run.ask("joint.home", joint="joint1")
    while run.ask("joint.list")["joints"][0]["homing"] != "homed":
        assert run.step()
    assert abs(run.state.position[0] - 0.5) < 0.02
    run.ask("controller.start")
    run.step()
    assert run.phase == "running" and not run.faults
    with pytest.raises(tandem.Error, match="is claimed by the controller 'hold'"):
        run.ask("joint.home", joint="joint1")


def test_gains_reach_the_drive(config):
    run = tandem.Run(config / "double_pendulum/hold.toml")
    run.ask("joint.gains", joint="joint1", loop="position", kp=3.0)
    run.step(50)
    gains = run.ask("joint.list")["joints"][0]["gains"]["position"]
    assert gains["kp"] == 3.0 and gains["ki"] == 12.0


def test_words_of_a_controller(config, tmp_path, nodding):
    run = tandem.Run(nodding, log=tmp_path / "a.mcap")
    run.step(3000)
    texts = run.texts
    assert texts and texts[0].controller == "nod" and texts[0].level in ("info", "warn")
    assert texts[0].time_s == pytest.approx(texts[0].cycle * run.period_s)
    run.close()
    said = [e for e in tandem.Log(run.log).events if texts[0].text in e.text]
    assert [e.cycle for e in said][:1] == [texts[0].cycle]


@pytest.fixture
def nodding(config, monkeypatch):
    """Example 08, by whose folder it is found."""
    monkeypatch.setenv("TANDEM_CONTROLLERS", str(BUILD / "lib/examples"))
    return config.parent / "examples/08_declarations/nod.toml"


def test_events_come_in_their_cycles(config, tmp_path):
    run = tandem.Run(experiment(tmp_path, config, """
[[controller]]
plugin = "hold"
[[push]]
link = "link2"
when = "phase() == running"
impulse_Ns = [0.1, 0, 0]
for_s = 0.02
[[event]]
name = "softer"
at_s = 0.6
ask = { do = "joint.gains", joint = "joint1", loop = "position", kp = 30.0 }
[[event]]
at_s = 0.7
ask = { do = "joint.gains", joint = "jiont1", loop = "position", kp = 30.0 }
"""))  # fmt: skip
    while run.time_s < 1.5:
        run.step()
    rows = {row["name"]: row for row in run.result["expectations"]}
    assert rows["push[0] comes"]["passed"] and rows["softer comes"]["passed"]
    assert rows["softer comes"]["at_s"] == 0.6
    assert "did you mean 'joint1'" in rows["event[1] comes"]["reason"]
