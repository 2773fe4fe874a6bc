"""A controller that crashes under Python: whose it was, a whole log, and the end by that signal."""

import os
import signal
import subprocess
import sys

import pytest
from conftest import BUILD, ROOT

import tandem

AFTER = 60  # updates until it crashes
HEAD = """
import ctypes, faulthandler, os, signal, sys, threading, time
import tandem
FILE, LOG = os.environ["EXPERIMENT"], os.environ["PLACE"]


def handlers():
    \"\"\"Addresses of what the process has installed.\"\"\"
    action, found = ctypes.create_string_buffer(512), []
    for number in (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT):
        assert ctypes.CDLL(None).sigaction(int(number), None, action) == 0
        found.append(action.raw[:8])
    return found
"""


@pytest.fixture
def crashing(tmp_path):
    """Runs Python's text with an experiment whose controller "lazy" has these parameters."""

    def run(text, parameters="for_s = 1e-9", *flags):
        file = tmp_path / "experiment.toml"
        file.write_text(
            f'robot = "{ROOT}/config/double_pendulum/robot.toml"\nposture = "ready"\nduration_s = 1.0\n'
            f'[[controller]]\nname = "lazy"\nplugin = "{BUILD}/tests/test_plugins/hangs.so"\n'
            f"[controller.parameters]\nafter_cycles = {AFTER}\n{parameters}\n"
        )
        return subprocess.run(
            [sys.executable, "-B", *flags, "-c", HEAD + text], capture_output=True, text=True, errors="replace", timeout=120,
            env={**os.environ, "EXPERIMENT": str(file), "PLACE": str(tmp_path / "a.mcap")},
        )  # fmt: skip

    return run


OPEN = "run = tandem.Run(FILE, log=LOG)\nprint(run.cycle, flush=True)\n"
STEPS = OPEN + "run.step(500)\nprint('alive')"
LOOP = OPEN + "for state in run:\n    pass\nprint('alive')"


@pytest.mark.parametrize("text", [STEPS, LOOP])
@pytest.mark.parametrize(
    "parameters, number, why, place",
    [
        ('crash = "null"', signal.SIGSEGV, "segmentation fault (SIGSEGV)", "update at "),
        ('crash = "stack"', signal.SIGSEGV, "segmentation fault (SIGSEGV)", "fill at "),
        ('crash = "abort"', signal.SIGABRT, "abort() (SIGABRT)", "update at "),
        ('crash = "divide"', signal.SIGFPE, "arithmetic error (SIGFPE)", "update at "),
        ('crash = "wild"', signal.SIGSEGV, "segmentation fault (SIGSEGV)", "crash at "),
        ("throws = true", signal.SIGABRT, "abort() (SIGABRT)", "complain"),
    ],
)
def test_a_crash_is_named_and_leaves_a_whole_log(crashing, tmp_path, text, parameters, number, why, place):
    ended = crashing(text, parameters)
    assert ended.returncode == -number and "alive" not in ended.stdout, ended.stderr
    for words in (f"fault: controller lazy crashed in update(): {why}", "called from (innermost first):\n",
                  place, "(hangs.so+0x", f"the log up to then is {tmp_path / 'a.mcap'}\n"):  # fmt: skip
        assert words in ended.stderr, ended.stderr
    log = tandem.Log(tmp_path / "a.mcap")
    assert not log.truncated
    first = int(ended.stdout)  # of control; the last cycle has no end
    assert list(log["state"].cycle[:, 0]) == list(range(first + AFTER - 1))
    info = subprocess.run([BUILD / "bin/tandem", "log", "info", log.path], capture_output=True, text=True)
    assert info.returncode == 0, info.stderr
    assert f"controller lazy crashed in update(): {why} at hangs.so+0x" in info.stdout
    assert f"{why} at hangs.so+0x" in log.result["ended"]


def test_exit_in_update_is_no_silent_end(crashing, tmp_path):
    ended = crashing(STEPS, 'crash = "exit"')
    assert ended.returncode == 1 and "alive" not in ended.stdout
    assert "fault: controller lazy called exit() in update()" in ended.stderr, ended.stderr
    assert "update at " in ended.stderr
    assert not tandem.Log(tmp_path / "a.mcap").truncated


@pytest.mark.parametrize("text", [STEPS, LOOP])
def test_faulthandler_has_its_turn_after_that(crashing, text):
    ended = crashing(text, 'crash = "null"', "-X", "faulthandler")
    assert ended.returncode == -signal.SIGSEGV
    said, its = ended.stderr.split("Fatal Python error: Segmentation fault")
    assert "controller lazy crashed in update()" in said and 'File "<string>", line ' in its


def test_without_a_log_it_is_named_too(crashing):
    ended = crashing("tandem.Run(FILE).step(500)", 'crash = "null"')
    assert ended.returncode == -signal.SIGSEGV
    assert "controller lazy crashed in update()" in ended.stderr and "the log" not in ended.stderr


def test_before_its_first_cycle_it_is_named(crashing):
    text = "before = handlers()\ntry:\n    tandem.Run(FILE)\nexcept tandem.Error:\n    pass\nprint('alive')"
    ended = crashing(text, 'crash = "null"\nat_once = true')
    assert ended.returncode == -signal.SIGSEGV and ended.stdout == ""
    assert "fault: controller lazy crashed before its first cycle: segmentation fault" in ended.stderr
    assert "configure at " in ended.stderr


@pytest.mark.parametrize("flags", [(), ("-X", "faulthandler")])
def test_between_steps_the_former_handlers_are_there(crashing, flags):
    ended = crashing("""
before = handlers()
run = tandem.Run(FILE, log=LOG)
assert handlers() == before
for _ in range(3):
    run.step()
    assert handlers() == before
run.step(10)
run.ask("controller.list")
run.restore(run.save()) if run.log is None else run.result
assert handlers() == before
try:
    run.step(0)
except ValueError:
    assert handlers() == before
print("same", flush=True)
ctypes.string_at(0)
""", "for_s = 1e-9", *flags)  # fmt: skip
    assert ended.stdout == "same\n", ended.stderr
    assert ended.returncode == -signal.SIGSEGV
    assert "controller" not in ended.stderr and "run crashed" not in ended.stderr
    assert ended.stderr.count("Fatal Python error") == len(flags) // 2


ELSEWHERE = """
run = tandem.Run(FILE, duration_s=1e6)
idle = handlers()
thread = threading.Thread(target=run.step, args=(10**8,), daemon=True)
thread.start()
while handlers() == idle:
    time.sleep(0.001)
"""


@pytest.mark.parametrize("flags", [(), ("-X", "faulthandler")])
@pytest.mark.parametrize("enabled_meanwhile", [False, True])
def test_a_crash_of_another_thread_is_not_the_controllers(crashing, flags, enabled_meanwhile):
    meanwhile = "faulthandler.enable()\n" if enabled_meanwhile else ""
    ended = crashing(ELSEWHERE + meanwhile + "print('steps', flush=True)\nctypes.string_at(0)",
                     "for_s = 1e-9", *flags)  # fmt: skip
    assert ended.stdout == "steps\n", ended.stderr
    assert ended.returncode == -signal.SIGSEGV
    assert "controller" not in ended.stderr
    assert ended.stderr.count("Fatal Python error") == int(bool(flags) or enabled_meanwhile)


def test_a_plugin_that_never_returns_is_ended_by_sigterm_alone(crashing):
    text = """
def end():
    while run.cycle < first + 59:  # that it hangs in
        time.sleep(0.001)
    for number in (signal.SIGINT, signal.SIGINT, signal.SIGTERM):
        print(number.name, flush=True)
        os.kill(os.getpid(), number)
        time.sleep(0.1)

run = tandem.Run(FILE)
first = run.cycle
threading.Thread(target=end, daemon=True).start()
run.step(500)
"""
    ended = crashing(text, "for_s = 600")
    assert ended.returncode == -signal.SIGTERM, ended.stderr
    assert ended.stdout == "SIGINT\nSIGINT\nSIGTERM\n" and ended.stderr == ""


def test_a_handler_of_python_hears_what_others_send(crashing):
    ended = crashing("""
heard = []
signal.signal(signal.SIGABRT, lambda *_: heard.append(1))
run = tandem.Run(FILE, duration_s=1e6)
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGABRT)).start()
while not heard:
    run.step(100)
print("heard", flush=True)
""")  # fmt: skip
    assert ended.stdout == "heard\n" and ended.returncode == 0, ended.stderr
