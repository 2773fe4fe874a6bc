"""tandem.Log: numbers against the program's own CSV, names, units, and what is refused."""

import csv
import gc
import io
import os
import subprocess

import numpy as np
import pytest
from conftest import BUILD

import tandem


def test_columns_are_those_that_the_program_writes(log_file):
    log = tandem.Log(log_file)
    text = subprocess.run(
        [BUILD / "bin/tandem", "log", "csv", log_file], check=True, capture_output=True, text=True
    ).stdout
    rows = list(csv.DictReader(io.StringIO(text)))  # from the first measurement on
    state = log["state"]
    cycles = [int(row["cycle"]) for row in rows]
    assert len(rows) > 1900 and len(state) == state.messages == len(state.time_s) > cycles[-1]
    for joint in log.joints:
        written = np.array([float(row[f"position_rad.{joint}"]) for row in rows])
        assert np.array_equal(state.position[joint][cycles], written)


def test_names_units_and_shapes(log_file):
    log = tandem.Log(log_file)
    assert log.robot == "double_pendulum" and log.joints == ["joint1", "joint2"]
    assert "/tandem/state" in log.channels and log["/tandem/state"] is log["state"]
    position = log["state"].position
    assert position is log["state"]["position_rad"]
    assert position.unit == "rad or m" and position.names == log.joints
    assert position.shape == np.asarray(position).shape == (log["state"].messages, 2)
    assert log["state"].units["temperature_c"] == "degC"
    assert np.allclose(np.diff(log["state"].time_s), 1e-3)
    assert log["state"].cycle[5, 0] == 5 and position[1000, 1] == position["joint2"][1000]
    assert log.info["seed"] == "1" and any("robot.toml" in path for path in log.configuration)
    assert not log.truncated and len(log.data_sha256) == 64


def test_what_was_not_measured_yet_is_no_number(log_file):
    log = tandem.Log(log_file)
    state, command = log["state"], log["command"]
    never = state.age_cycles.values > state.cycle.values
    assert never.any() and not never.all()
    for column in (state.position, state.torque, state.velocity):
        assert np.array_equal(np.isnan(column.values), never)
    assert np.array_equal(np.isnan(command.position.values), never)
    assert not np.isnan(command.torque.values).any()
    assert not np.isnan(log["truth"].position.values).any()


def test_events_are_a_list(log_file):
    events = tandem.Log(log_file).events
    assert events[0].cycle == 0 and events[0].text
    assert [e.time_s for e in events] == sorted(e.time_s for e in events)


def test_nothing_is_read_before_it_is_asked_for(log_file):
    channel = tandem.Log(log_file)["state"]
    assert channel._columns is None and channel.fields and repr(channel)
    assert channel._columns is None
    assert channel.position.values.any() and channel._columns is not None


def test_arrays_outlive_their_log_and_are_read_only(log_file):
    column = tandem.Log(log_file)["state"].position["joint1"]
    kept = column.copy()
    gc.collect()
    assert np.array_equal(column, kept, equal_nan=True)
    with pytest.raises(ValueError):
        column[0] = 1.0


def test_what_is_not_there_is_named(log_file):
    log = tandem.Log(log_file)
    with pytest.raises(KeyError, match="no such channel of .* 'stat'.*did you mean"):
        log["stat"]
    assert log["tf"] is log["/tf"]
    with pytest.raises(tandem.UnknownName, match="did you mean 'position_rad'"):
        log["state"]["positon_rad"]
    with pytest.raises(AttributeError, match="no such field"):
        log["state"].nothing
    assert not hasattr(log["state"], "nothing")
    with pytest.raises(KeyError, match="did you mean 'joint1'"):
        log["state"].position["jiont1"]
    with pytest.raises(tandem.Error, match="not all numbers"):
        log["event"]["text"]


def test_columns_are_numbers_to_numpy(log_file):
    log = tandem.Log(log_file)
    position = log["state"].position
    values = position.values
    assert np.array_equal(position - 1, values - 1.0, equal_nan=True)
    assert np.array_equal(2 * position + position, 3 * values, equal_nan=True)
    assert np.array_equal(np.abs(position), abs(values), equal_nan=True)
    assert ((position > 0) == (values > 0)).all()
    with pytest.raises(TypeError):
        np.add(values, 1, out=position)
    for channel in log:
        assert isinstance(channel.units, dict)


def test_files_that_are_no_logs(tmp_path, log_file):
    with pytest.raises(FileNotFoundError, match="none.mcap"):
        tandem.Log(tmp_path / "none.mcap")
    with pytest.raises(tandem.Error):
        tandem.Log(__file__)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log_file.read_bytes()[:-100_000])
    with pytest.warns(UserWarning, match="cut.mcap: the log is cut: its run was killed, or"):
        part = tandem.Log(cut)
    ends = f"what can be read ends at {max(one.last_s for one in part):.3f} s"
    assert part.truncated and len(part.remarks) == 1 and ends in part.remarks[0]
    assert len(part["state"].position.values) > 0
    damaged = bytearray(log_file.read_bytes())
    damaged[len(damaged) // 2] ^= 0xFF
    (tmp_path / "damaged.mcap").write_bytes(damaged)
    with pytest.warns(UserWarning, match="its checksum is wrong; its messages are left out"):
        rest = tandem.Log(tmp_path / "damaged.mcap")
    assert "its checksum is wrong" in rest.remarks[0] and not rest.truncated
    assert 0 < len(rest["state"]) < len(tandem.Log(log_file)["state"])


def test_a_log_in_several_files_is_one(tmp_path, config):
    experiment = tmp_path / "parts.toml"
    experiment.write_text(
        f'robot = "{config}/double_pendulum/robot.toml"\nduration_s = 20\n'
        '[log]\nfile_MB = 4\n[[controller]]\nplugin = "hold"\n'
    )
    subprocess.run(
        [BUILD / "bin/tandem", "run", experiment, "--no-socket", "--no-dds", "--quiet", "--log", tmp_path],
        check=True,
    )
    first = next(tmp_path.glob("*-001.mcap"))
    whole = tandem.Log(first)
    assert len(whole.parts) > 2 and whole.remarks == []
    cycles = whole["state"].cycle.values[:, 0]
    assert np.array_equal(cycles, np.arange(len(whole["state"])))
    alone = tandem.Log(whole.parts[1])
    assert alone.parts == [whole.parts[1]]
    assert "opens all of them" in alone.remarks[0]
    os.remove(whole.parts[0])
    rest = tandem.Log(first)
    assert rest.parts == whole.parts[1:]
    assert rest.remarks[0].startswith("the log lacks part 1; what is here is from ")
    assert len(rest["state"]) < len(whole["state"])
