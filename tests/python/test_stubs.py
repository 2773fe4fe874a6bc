"""The stubs and the docstrings against the module."""

import ast
import inspect
import pathlib
import re
import subprocess

import tandem
from tandem import _native

FOLDER = pathlib.Path(tandem.__file__).parent


def stubs():
    """{name: {member: argument names}} of the stub file's classes; of functions their names."""
    found = {}
    for node in ast.parse((FOLDER / "_native.pyi").read_text()).body:
        if isinstance(node, ast.ClassDef):
            found[node.name] = {
                member.name: [a.arg for a in member.args.args]
                for member in node.body
                if isinstance(member, ast.FunctionDef)
            }
        elif isinstance(node, ast.FunctionDef):
            found[node.name] = [a.arg for a in node.args.args]
    return found


def signature(function):
    """Names of the arguments as pybind11 writes them; arg0 where it knows none."""
    line = function.__doc__.splitlines()[0]
    inside = line[line.index("(") + 1 : line.rindex(") ->")]
    return re.findall(r"(?:^|, )(\w+): ", inside)


def test_every_name_is_in_both():
    native = {name for name in vars(_native) if not name.startswith("__")}
    assert native == set(stubs())
    for name, members in stubs().items():
        if isinstance(members, list) or issubclass(getattr(_native, name), Exception):
            continue
        real = {m for m in vars(getattr(_native, name)) if not m.startswith("_")} | {"__init__"}
        assert real == set(members), name


def test_arguments_have_the_stubs_names():
    checked = 0
    for name, members in stubs().items():
        if isinstance(members, list):
            assert signature(getattr(_native, name)) == members
            continue
        for member, arguments in members.items():
            real = getattr(getattr(_native, name), member)
            if isinstance(real, property):
                continue
            assert signature(real)[1:] == arguments[1:], f"{name}.{member}"
            checked += 1
    assert checked > 25


def test_public_members_have_docstrings_and_annotations():
    for name in tandem.__all__:
        one = getattr(tandem, name)
        assert one.__doc__, name
        if issubclass(one, Exception) or hasattr(one, "_fields"):
            continue
        for member, function in inspect.getmembers(one, inspect.isfunction):
            if member.startswith("_") and member != "__init__":
                continue
            if not function.__module__.startswith("tandem"):  # what a Mapping has besides
                continue
            assert function.__doc__ or member == "__init__", f"{name}.{member}"
            parameters = list(inspect.signature(function).parameters.values())[1:]
            assert all(p.annotation is not p.empty for p in parameters), f"{name}.{member}"
            assert inspect.signature(function).return_annotation is not inspect.Signature.empty


def test_annotated_attributes_are_there(config, log_file):
    run, model = tandem.Run(config / "double_pendulum/hold.toml"), tandem.Model(
        config / "double_pendulum/robot.toml")  # fmt: skip
    log = tandem.Log(log_file)
    for one in (run, model, log, log["state"], log["state"].position, run.state):
        for name in type(one).__annotations__:
            assert hasattr(one, name), f"{type(one).__name__}.{name}"


def test_the_module_exports_what_python_calls_alone():
    """A plugin, and another module, have their own of everything else."""
    text = subprocess.run(["nm", "-D", "--defined-only", _native.__file__], check=True,
                          capture_output=True, text=True).stdout  # fmt: skip
    assert [line.split()[-1] for line in text.splitlines()] == ["PyInit__native"]


def test_the_package_says_that_it_is_typed():
    assert (FOLDER / "py.typed").exists()
