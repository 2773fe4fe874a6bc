"""Example 09: an environment, as Gymnasium's users expect it."""

import sys

import numpy as np
import pytest
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


def test_it_keeps_gymnasiums_contract():
    """What gymnasium's check_env looks at, which is used where it is installed."""
    env = PandaEnv(duration_s=0.05)
    assert env.action_space.shape == (7,) and env.action_space.dtype == np.float32
    rng = np.random.default_rng(1)
    actions = rng.uniform(-0.1, 0.1, (49, 7)).astype(np.float32)

    def episode(seed):
        observation, info = env.reset(seed=seed, options={})
        assert type(info) is dict
        seen = [observation]
        for action in actions:
            assert env.action_space.contains(action)
            observation, reward, terminated, truncated, info = env.step(action)
            assert type(reward) is float and type(terminated) is bool and type(truncated) is bool
            assert type(info) is dict
            seen.append(observation)
        assert not truncated and env.step(actions[0])[3]
        assert all(env.observation_space.contains(one) for one in seen)
        return np.array(seen)

    first, state = episode(123), env.np_random.bit_generator.state
    episode(456)
    assert np.array_equal(first, episode(123))
    kept = env.reset(seed=123)[0]
    copy = kept.copy()
    assert env.np_random.bit_generator.state == state
    env.step(actions[0])
    assert np.array_equal(kept, copy)  # an observation is not a view


def test_actions_that_do_not_fit_are_refused_and_the_episode_goes_on():
    env = PandaEnv(duration_s=0.05)
    before = env.reset(seed=1)[0]
    for bad in (np.zeros(3), np.zeros((7, 1)), np.zeros(1), 0.0):
        with pytest.raises(ValueError, match=r"action: has the shape .*wanted \(7,\)"):
            env.step(bad)
    with pytest.raises(ValueError, match="of panda_joint2 is not finite"):
        env.step(np.array([0, np.nan, 0, 0, 0, 0, 0]))
    assert np.array_equal(env.observe(), before)
    strided = np.zeros((7, 2), order="F")[:, ::2][:, 0]
    assert env.observation_space.contains(env.step(strided)[0])
