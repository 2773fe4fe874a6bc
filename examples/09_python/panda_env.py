"""09: Panda as an environment for learning, in the form of Gymnasium's, which is not needed for it.

    export PYTHONPATH=build/release/lib/python3/dist-packages
    python3 examples/09_python/panda_env.py

A control step is a cycle of 1 ms through the whole chain: frames, boards' firmware, motors, body.
"""
import pathlib
import time

import numpy as np

import tandem

CONFIG = pathlib.Path(__file__).resolve().parents[2] / "config"
GOAL = np.array([0.4, -0.5, 0.0, -2.0, 0.0, 1.8, 0.5])  # rad


try:
    from gymnasium import Env
    from gymnasium.spaces import Box
except ImportError:  # what of it an environment needs

    class Env:
        def reset(self, *, seed=None, options=None):
            if seed is not None:
                self.np_random = np.random.default_rng(seed)

    class Box:
        def __init__(self, low, high, shape, dtype):
            self.low, self.high, self.shape, self.dtype = low, high, shape, np.dtype(dtype)

        def contains(self, x):
            fits = x.shape == self.shape and x.dtype == self.dtype
            return bool(fits and np.all(x >= self.low) and np.all(x <= self.high))


class PandaEnv(Env):
    """Action (7): share of each joint's torque, -1 to 1. Observation (14): position, velocity.

    An episode begins as a controller does: in its first 0.1 s the torque goes over from what held
    the joints to the action. `run.sent.torque` is what the drives were given.
    """

    metadata = {"render_modes": []}
    render_mode = None
    action_space = Box(-1.0, 1.0, (7,), np.float32)
    observation_space = Box(-np.inf, np.inf, (14,), np.float64)

    def __init__(self, duration_s=1.0):
        self.duration_s = duration_s
        self.open(seed=1)

    def open(self, seed):
        self.run = tandem.Run(CONFIG / "panda/hold.toml", control="torque", seed=seed,
                              duration_s=self.duration_s)  # fmt: skip
        self.begin = self.run.save()
        self.max_torque = self.run.limits["max_torque_Nm"]

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        if seed is not None and seed != self.run.seed:
            self.open(seed)
        self.run.restore(self.begin)
        return self.observe(), {}

    def observe(self):
        state = self.run.state
        return np.concatenate((state.position, state.velocity))

    def step(self, action):
        if np.shape(action) != (7,):
            raise ValueError(f"action: has the shape {np.shape(action)}, wanted (7,)")
        np.multiply(action, self.max_torque, out=self.run.command.torque)
        goes_on = self.run.step()
        error = self.run.state.position - GOAL
        return self.observe(), -float(error @ error), False, not goes_on, {}


if __name__ == "__main__":
    env = PandaEnv()
    model = tandem.Model(env.run.robot_file)
    steps, begun = 0, time.process_time()
    for episode in range(20):
        observation, _ = env.reset()
        total, truncated = 0.0, False
        while not truncated:
            q, v = observation[:7], observation[7:]
            torque = model.inverse_dynamics(q, v, (100.0 + episode) * (GOAL - q) - 20.0 * v)
            observation, reward, _, truncated, _ = env.step(torque / env.max_torque)
            total += reward
            steps += 1
        if episode % 10 == 0:
            print(f"episode {episode}: return {total:.3f}")
    print(f"{steps / (time.process_time() - begun):.0f} control steps a second of a core")
