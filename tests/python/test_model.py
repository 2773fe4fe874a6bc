"""tandem.Model: kernels against each other, batches against rows, and what is refused."""

import signal

import numpy as np
import pytest

import tandem


@pytest.fixture(scope="module")
def panda():
    from conftest import ROOT

    return tandem.Model(ROOT / "config/panda/robot.toml")


@pytest.fixture
def states(panda):
    random = np.random.default_rng(1)
    return random.uniform(-1, 1, (50, panda.nq)), random.uniform(-1, 1, (50, panda.nv))


def test_names_and_sizes(panda):
    assert (panda.robot, panda.nq, panda.nv, panda.floating_base) == ("panda", 7, 7, False)
    assert panda.joints[0] == "panda_joint1" and panda.sites == ["hand"]
    assert list(panda.indices(["panda_joint3", "panda_joint1"])) == [2, 0]
    assert 15.0 < panda.mass_kg < 20.0


def test_dynamics_agree_with_each_other(panda, states):
    q, v = states
    tau = np.sin(7.0 * q)
    vdot = panda.forward_dynamics(q, v, tau)
    assert np.allclose(panda.inverse_dynamics(q, v, vdot), tau, atol=1e-9)
    mass, bias = panda.mass_matrix(q), panda.bias(q, v)
    assert np.allclose(np.einsum("nij,nj->ni", mass, vdot) + bias, tau, atol=1e-9)
    kinetic = panda.energy(q, v)[:, 0]  # without the armature's it is less
    assert np.allclose(kinetic, 0.5 * np.einsum("ni,nij,nj->n", v, mass, v), rtol=1e-9)


def test_batch_is_its_rows_bit_for_bit(panda, states):
    q, v = states
    together = panda.forward_dynamics(q, v, np.zeros(panda.nv))
    for i in (0, 17, 49):
        assert np.array_equal(together[i], panda.forward_dynamics(q[i], v[i], np.zeros(panda.nv)))
    assert panda.mass_matrix(q).shape == (50, 7, 7)
    assert panda.forward_dynamics(q[:0], v[:0], v[:0]).shape == (0, 7)


def test_sites_move_as_their_jacobian_says(panda, states):
    q, v = states
    step = 1e-7
    before, after = panda.site_pose("hand", q), panda.site_pose("hand", q + step * v)
    twist = panda.site_twist("hand", q, v)
    assert before.shape == (50, 4, 4)
    assert np.allclose((after - before)[:, :3, 3] / step, twist[:, :3], atol=1e-5)
    assert np.allclose(np.einsum("nij,nj->ni", panda.site_jacobian("hand", q), v), twist, atol=1e-12)


def test_derivatives_are_differences(config, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))  # built, and not left behind
    pendulum = tandem.Model(config / "double_pendulum/robot.toml", derivatives=True)
    q, v, tau, h = np.array([0.5, -0.5]), np.array([0.3, 0.2]), np.array([0.1, 0.0]), 1e-6
    by_q, by_v, by_tau = pendulum.forward_dynamics_derivatives(q, v, tau)
    for j, e in enumerate(np.eye(2) * h):
        for matrix, plus, minus in (
            (by_q, (q + e, v, tau), (q - e, v, tau)),
            (by_v, (q, v + e, tau), (q, v - e, tau)),
            (by_tau, (q, v, tau + e), (q, v, tau - e)),
        ):
            change = pendulum.forward_dynamics(*plus) - pendulum.forward_dynamics(*minus)
            assert np.allclose(matrix[:, j], change / (2 * h), rtol=1e-5, atol=1e-6)


def test_floating_base_wants_a_quaternion(config):
    coman = tandem.Model(config / "coman/robot.toml")
    q = np.zeros(coman.nq)
    with pytest.raises(ValueError, match="quaternion"):
        coman.mass_matrix(q)
    q[6] = 1.0
    mass = coman.mass_matrix(q)
    assert mass[0, 0] == pytest.approx(coman.mass_kg)
    position, velocity, _ = coman.center_of_mass(q, np.zeros(coman.nv))
    assert position.shape == (3,) and not velocity.any()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (([0.0] * 6, [0.0] * 7, [0.0] * 7), r"q: has the shape \(6,\), wanted \(7,\)"),
        (([0.0] * 7, [0.0, np.nan] + [0.0] * 5, [0.0] * 7), "v: element 1 is not finite"),
        (([0.0] * 7, [0.0] * 7, np.zeros((3, 2, 7))), "tau: has the shape"),
        ((np.zeros((3, 7)), np.zeros((4, 7)), [0.0] * 7), "v: has 4 rows"),
        ((np.zeros((3, 7)), [[0.0] * 7] * 2 + [[np.inf] * 7], [0.0] * 7), "v: element 0 of row 2"),
        (("joint", [0.0] * 7, [0.0] * 7), "q: is no array of numbers"),
        ((None, [0.0] * 7, [0.0] * 7), "q: is no array of numbers"),
    ],
)
def test_bad_arguments_are_named(panda, arguments, words):
    if arguments[1].__class__ is list and isinstance(arguments[1][0], list):
        arguments = (arguments[0], np.array(arguments[1]), arguments[2])
        if arguments[1].shape != (3, 7):
            arguments = (arguments[0], np.vstack(arguments[1]), arguments[2])
    with pytest.raises(ValueError, match=words):
        panda.forward_dynamics(*arguments)


def test_unknown_names_have_a_nearest(panda):
    with pytest.raises(tandem.UnknownName, match="did you mean 'hand'"):
        panda.site_pose("hnad", np.zeros(7))
    with pytest.raises(KeyError, match="did you mean 'panda_joint1'"):
        panda.indices(["pandajoint1"])


def test_missing_robot_and_missing_derivatives(panda, tmp_path):
    with pytest.raises(FileNotFoundError):
        tandem.Model(tmp_path / "robot.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("name = 3\n")
    with pytest.raises(tandem.Error, match="broken.toml"):
        tandem.Model(broken)
    with pytest.raises(tandem.Error, match="derivatives=True"):
        panda.forward_dynamics_derivatives(np.zeros(7), np.zeros(7), np.zeros(7))


@pytest.mark.parametrize("bad", [["1"] * 7, [1j] * 7, "abc", None, [None] * 7])
def test_what_is_no_number_is_refused(panda, bad):
    with pytest.raises(ValueError, match="q: is no array of numbers"):
        panda.mass_matrix(bad)


def test_signals_are_heard_in_a_batch(panda):
    """Ctrl-C is one; those that come meanwhile would else be one at its end."""
    q, heard = np.zeros((1_000_000, 7)), []
    before = signal.signal(signal.SIGALRM, lambda *_: heard.append(1))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.002, 0.002)
        panda.bias(q, np.zeros(7))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert len(heard) > 5
