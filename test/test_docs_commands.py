"""Every command line of README, CONTRIBUTING and docs is run, or read by its own parser, or listed with the reason why not.

``doc_commands.py`` finds them, ``doc_command_rows.py`` has a row for each.
"""

import argparse
import importlib
import json
import os
import re
import runpy
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from doc_command_rows import RECORD, ROWS, Listed, Named, Parsed, Run, Usage
from doc_commands import PAGES, ROOT, code_in_text, commands_in, doc_commands
from evaluation_files import document as evaluation
from evaluation_files import frame
from evaluation_files import write as write_evaluation
from sample_scene import sample_scene
from scene_synth_ros_suite import environment

from scene_description import scene_to_json
from scene_description.strict import field_types, read_value
from scene_synth_ros.cli.command_line import COMMANDS, main
from scene_synth_ros.cli.commands.layers_command import layers_page
from scene_synth_ros.cli.page.page_file import NODE_GROUPS
from scene_synth_ros.cli.parameters.run_profile import apply_overrides, load_profile
from scene_synth_ros.messages.image_codec import ImageCompression
from scene_synth_ros.record.recorder_config import RecorderConfig, SplitPolicy

COMMANDS_OF_PAGES = doc_commands()
FOLDERS = ("config", "launch", "examples", "benchmarks", "kernel_cache", "scene_description", "grammar", "renderer", "scene_synth_ros")
"""Their comments and docstrings name commands."""
PARAMETERS = {**NODE_GROUPS, "recorder_node": {"": RecorderConfig, "split": SplitPolicy, "images": ImageCompression}}
TESTS = re.compile(r"(test/[\w/]+\.py)(?:::(\w+))?")


class _ParsedArguments(BaseException):
    """Carries what a parser has read out of the program, before it does anything."""


@contextmanager
def only_parsing(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[argparse.Namespace]]:
    """Yield a list that gets the arguments of the program that is called within; the program goes no further."""
    read, found, handler = argparse.ArgumentParser.parse_args, [], signal.getsignal(signal.SIGINT)

    def parse_args(parser: argparse.ArgumentParser, *words: object) -> argparse.Namespace:
        found.append(read(parser, *words))
        raise _ParsedArguments

    with monkeypatch.context() as patch:
        patch.setattr(argparse.ArgumentParser, "parse_args", parse_args)
        try:
            yield found
        except _ParsedArguments:
            pass
        finally:
            signal.signal(signal.SIGINT, handler)


def parse(line: str, monkeypatch: pytest.MonkeyPatch) -> argparse.Namespace:
    """Return what a line's own parser makes of its words; the line is one of ``scene_synth`` or of a Python module."""
    words = shlex.split(line)
    with only_parsing(monkeypatch) as found:
        if "-m" in words[:2]:
            module, rest = words[2], words[3:]
            monkeypatch.setattr(sys, "argv", [module, *rest])
            runpy.run_module(module, run_name="__main__")
        else:
            main(words[1:])
    (arguments,) = found
    return arguments


def check_run(arguments: argparse.Namespace) -> None:
    """Refuse profiles, parameters and values that a run would refuse."""
    for profile in [*([arguments.params] if arguments.params else []), *arguments.overlay]:
        load_profile(profile)
    for node, values in apply_overrides({}, arguments.overrides).items():
        for name, value in values.items():
            group, _, field = name.rpartition(".")
            read_value(field_types(PARAMETERS[node][group])[field], value, name)


def filled(usage: str) -> str:
    """Return a command line of a form: all options given, the first of several choices, numbers where numbers stand."""
    line = re.sub(r"[\[\]]| \.\.\.", "", usage)
    return re.sub(r"\b(N|S|R|HZ|PX)\b", "1", re.sub(r"(\w+)(\|\w+)+", r"\1", line))


def check_names(line: str) -> None:
    """Refuse a part of a command line whose command or options do not exist."""
    words = line.split()[1:]
    name = next((word for word in words if re.fullmatch("[a-z]+", word)), None)
    if name is None:
        return
    assert name in COMMANDS, f"{line}: expected one of {', '.join(COMMANDS)}"
    options = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", line))
    parser = argparse.ArgumentParser()
    importlib.import_module(f"scene_synth_ros.cli.commands.{COMMANDS[name].module}").add_arguments(parser)
    assert options <= set(parser._option_string_actions), f"{line}: no such option of scene_synth {name}"


def rows_of(*kinds: type) -> list[str]:
    return [command for command, row in ROWS.items() if isinstance(row, kinds)]


def test_every_command_has_a_row_and_every_row_a_command() -> None:
    found = {command.text for command in COMMANDS_OF_PAGES}
    without = [str(command) for command in COMMANDS_OF_PAGES if command.text not in ROWS]
    assert not without, "no row in test/helpers/doc_command_rows.py for\n" + "\n".join(without)
    assert not set(ROWS) - found, "in test/helpers/doc_command_rows.py, but on no page\n" + "\n".join(set(ROWS) - found)


def test_commands_are_found_in_blocks_and_in_text() -> None:
    page = """A `make run` in text, `not a command`, `scene_synth
verify BAG` over two lines.

```
make test   # comment
scene_synth render \\
  a.json  --out b
frobnicate
```

```python
source = make
```

    scene_synth sample -p must_have:='[desk]'

| `make a\\|b` |
"""
    assert sorted(commands_in(page)) == [
        (1, "make run"),
        (1, "scene_synth verify BAG"),
        (5, "make test"),
        (6, "scene_synth render a.json --out b"),
        (8, "frobnicate"),
        (15, "scene_synth sample -p must_have:='[desk]'"),
        (17, "make a|b"),
    ]


def test_rows_name_tests_that_exist() -> None:
    for command in rows_of(Parsed, Usage, Listed):
        for file, test in TESTS.findall(" ".join(ROWS[command])):
            assert (ROOT / file).is_file(), f"{command}: {file}"
            assert not test or f"def {test}(" in (ROOT / file).read_text(encoding="utf-8"), f"{command}: {file}::{test}"


@pytest.mark.parametrize("command", rows_of(Parsed))
def test_its_parser_takes_it(command: str, docs_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if command.startswith("make "):
        line = ["make", "--dry-run", "--always-make", *shlex.split(command)[1:]]
        made = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
        assert made.returncode == 0, made.stderr
        printed = re.sub(r"\$\([^)]*\)", "NOW", made.stdout.replace("\\\n", " "))
        lines = [line.split(">")[0] for line in printed.splitlines() if " -m scene_synth_ros " in line or " -m benchmarks " in line]
    else:
        lines = [command]
    monkeypatch.chdir(docs_folder)
    for line in lines:
        line = line.replace("-m scene_synth_ros", "")
        arguments = parse(line.removeprefix(".venv/bin/"), monkeypatch)
        if getattr(arguments, "command", "") == "run":
            check_run(arguments)


@pytest.mark.parametrize("command", rows_of(Usage))
def test_a_form_with_all_its_options_is_taken(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    parse(filled(command), monkeypatch)


@pytest.mark.parametrize("command", rows_of(Named))
def test_commands_and_options_that_are_named_exist(command: str) -> None:
    check_names(command)


def test_options_that_pages_name_alone_are_those_of_a_run_and_of_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = [code for page in PAGES for _, code in code_in_text(page.read_text(encoding="utf-8"))]
    named = [code for code in pieces if re.match(r"-p |--(params|overlay) ", code) and not re.search(r"\b[A-Z]{2}", code)]
    assert len(named) > 3
    for code in named:
        arguments = parse(f"scene_synth run {code}", monkeypatch)
        arguments.overrides = [text if text.split(".")[0] in PARAMETERS else f"grammar_node.scene.{text}" for text in arguments.overrides]
        check_run(arguments)


def test_comments_and_docstrings_name_commands_and_options_that_exist() -> None:
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.*"))]
    for path in files:
        if path.suffix in (".py", ".yaml", ".xml"):
            for code in re.findall(r"`+(scene_synth [^`]+)`+", path.read_text(encoding="utf-8")):
                check_names(" ".join(code.split()))


def test_lines_of_ros2_name_what_the_package_has() -> None:
    docstrings = [line.strip() for path in (ROOT / "launch").glob("*.py") for line in path.read_text(encoding="utf-8").splitlines()]
    lines = [*(command.text for command in COMMANDS_OF_PAGES), *(line.split("#")[0] for line in docstrings)]
    launched = [words for line in lines if (words := line.split())[:3] == ["ros2", "launch", "scene_synth_ros"]]
    assert len(launched) > 4
    for _, _, _, file, *arguments in launched:
        text = (ROOT / "launch" / file).read_text(encoding="utf-8")
        for name, value in (argument.split(":=", 1) for argument in arguments):
            assert f'"{name}"' in text, f"launch/{file} has no argument {name}"
            if name in ("params_file", "overlay_file"):
                load_profile(Path(value))
    setup = (ROOT / "setup.py").read_text(encoding="utf-8")
    for line in lines:
        for program in re.findall(r"ros2 run scene_synth_ros (\w+)", line):
            assert f'"{program} = ' in setup, f"setup.py has no entry point {program}"


def test_extras_and_files_that_lines_name_exist() -> None:
    setup = (ROOT / "setup.py").read_text(encoding="utf-8")
    for command in COMMANDS_OF_PAGES:
        for extras in re.findall(r"(?:scene_synth_ros|\.)\[([\w,-]+)\]", command.text):
            assert all(f'"{extra}": [' in setup for extra in extras.split(",")), str(command)
        for file in re.findall(r"\b(?:config|examples|launch)/[\w/.]+\.\w+", command.text):
            assert (ROOT / file).is_file(), str(command)
        assert not re.search(r"(params|overlay|params_file:=|overlay_file:=) ?config/", command.text), f"{command}: expected its name"


def block_of(page: str, language: str, sign: str) -> str:
    """Return the code block of a page that has ``sign`` in it."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if language else re.findall(r"(?<=\n\n)(?:    [^\n]+\n)+", text)
    (block,) = (block for block in blocks if sign in block)
    return block


def fill_folder(folder: Path) -> None:
    """Put what the pages' lines read into a folder: a scene, a grammar, layouts, evaluations, an environment map."""
    for name in ("room.json", "SCENE.json"):
        (folder / name).write_text(scene_to_json(sample_scene()), encoding="utf-8")
    (folder / "waiting_room.yaml").write_text(block_of("docs/grammar.md", "yaml", "room_type: waiting_room"), encoding="utf-8")
    layout = json.loads(block_of("docs/learning.md", "", '"scene_synth.layout/1"'))
    for name in ("LAYOUTS.jsonl", "MORE.jsonl"):
        lines = [json.dumps({**layout, "house": f"{name}{number}"}) for number in range(3)]
        (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "my_files").mkdir()
    pixels = np.full((8, 16, 4), 128, np.uint8)
    (folder / "my_files" / "street.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + pixels.tobytes())
    for name in ("evaluation.json", "before.json", "after.json"):
        write_evaluation(folder / name, evaluation([frame("0", 0, {"light": 1.0}, {"abs_rel": 0.5, "delta_1": 1.0})]))
    (folder / "docs").mkdir()
    (folder / "examples").symlink_to(ROOT / "examples")
    programs = folder / ".venv" / "bin"
    programs.mkdir(parents=True)
    for program, words in (("python", ""), ("scene_synth", "-m scene_synth_ros")):
        (programs / program).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {words} "$@"\n', encoding="utf-8")
        (programs / program).chmod(0o755)


def run_in_shell(folder: Path, line: str) -> None:
    """Run a line as a user's shell does, with the environment's programs on the PATH."""
    env = environment()
    env |= {"PATH": f"{folder / '.venv' / 'bin'}{os.pathsep}{env['PATH']}"}
    for display in ("DISPLAY", "WAYLAND_DISPLAY"):
        env.pop(display, None)
    done = subprocess.run(["bash", "-c", line], cwd=folder, env=env, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"


def run_here(folder: Path, line: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    """Run the programs of a line in this process, in the folder: those of ``scene_synth`` and of Python, with ``&&`` and ``>``."""
    for command in line.split("&&"):
        words, _, target = command.partition(" > ")
        program, *rest = shlex.split(words)
        handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
        path = list(sys.path)
        capfd.readouterr()
        with monkeypatch.context() as patch:
            patch.chdir(folder)
            for display in ("DISPLAY", "WAYLAND_DISPLAY"):
                patch.delenv(display, raising=False)
            patch.setattr(sys, "argv", [program, *rest])
            try:
                code = call(program, rest)
            finally:
                sys.path[:] = path
                for number, handler in handlers.items():
                    signal.signal(number, handler)
        out, err = capfd.readouterr()
        assert code == 0, f"{line}\n{out[-2000:]}\n{err[-4000:]}"
        if target:
            (folder / target.strip()).write_text(out, encoding="utf-8")


def call(program: str, words: list[str]) -> int:
    """Call a program with words; return its exit status."""
    try:
        if program == "scene_synth":
            main(words)
        elif words[0] == "-c":
            exec(compile(words[1], "-c", "exec"), {"__name__": "__main__"})
        else:
            sys.argv = words
            sys.path.insert(0, str(Path(words[0]).parent))
            runpy.run_path(words[0], run_name="__main__")
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return 0


def check_files(folder: Path, row: Run) -> None:
    assert [name for name in row.makes if not (folder / name).exists()] == []


@pytest.fixture
def docs_folder(tmp_path: Path) -> Path:
    fill_folder(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which RECORD has run."""
    folder = tmp_path_factory.mktemp("recorded")
    fill_folder(folder)
    row = ROWS[RECORD]
    assert isinstance(row, Run)
    run_in_shell(folder, row.line)
    check_files(folder, row)
    return folder


def test_recording(recorded: Path) -> None:
    assert "scene_synth" in (recorded / "page.html").read_text(encoding="utf-8")


IN_A_SHELL = ("python3 -m venv", "scene_synth replay")
"""How lines begin that need a process of their own, as RECORD does: one makes an environment, one is a node, which ends its process."""


@pytest.mark.parametrize("command", [command for command in rows_of(Run) if command != RECORD])
def test_it_runs(
    command: str, docs_folder: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    row = ROWS[command]
    assert isinstance(row, Run)
    line = row.line or command
    if "BAG" in line:
        shutil.copytree(request.getfixturevalue("recorded") / "BAG", docs_folder / "BAG")
    if line.startswith(IN_A_SHELL):
        run_in_shell(docs_folder, line)
    else:
        run_here(docs_folder, line, monkeypatch, capfd)
    check_files(docs_folder, row)
    if "docs/layers.md" in row.makes:
        assert (docs_folder / "docs" / "layers.md").read_text(encoding="utf-8") == layers_page()
