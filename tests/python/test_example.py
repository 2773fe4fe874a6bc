"""Example 09: an environment, as Gymnasium's users expect it."""

import sys

import numpy as np
from conftest import ROOT

sys.path.insert(0, str(ROOT / "examples/09_python"))

from panda_env import PandaEnv  # noqa: E402


def test_resets_steps_and_ends():
    env = PandaEnv(duration_s=0.1)
    first, info = env.reset(seed=5)
    assert first.shape == (14,) and info == {}

    def episode():
        observation, steps, over = env.reset()[0], [], False
        while not over:
            observation, reward, terminated, over, _ = env.step(np.zeros(7))
            steps.append(observation)
            assert reward < 0.0 and not terminated
        return np.array(steps)

    one = episode()
    assert one.shape == (100, 14) and np.array_equal(one, episode())
    assert np.array_equal(env.reset(seed=5)[0], first)
