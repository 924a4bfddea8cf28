"""Builds the packages of messages and services that the PyPI wheels of ROS 2 lack, so that tests run the code that a real ROS 2 runs.

``python test/interfaces/build.py`` reads the definitions of ``PACKAGES``, of which the recorder writes some into bags, has the wheels' own
rosidl generators write C, C++ and Python from them, compiles that and installs the result into the virtual environment, where the wheels
have theirs: Python modules, ``lib/lib<package>__rosidl_typesupport_*.so``, ``share/<package>/msg`` and ``srv``, and the ament index.  A
second run finds nothing to do until an input changes.  It needs a C and a C++ compiler and Python's headers.

CMake would make six libraries of a package.  Here all its C is one Python extension, which the type support finds under the two names
that it looks for.  Only Python can load it, and it has no actions.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

SOURCES = Path(__file__).parents[2] / "scene_synth_ros" / "messages" / "interfaces"
"""Of the definitions that the program carries, ``<package>/msg/<Type>.msg``."""

PACKAGES = {
    "tf2_msgs": SOURCES,
    "vision_msgs": SOURCES,
    "simulation_interfaces": Path(__file__).with_name("definitions"),
}
"""Package -> folder that has its own, with the definitions in ``msg`` and ``srv``.  Of simulation_interfaces it is version 2.1.0, as far as
it is served."""
PREFIX = Path(sys.prefix)
SHARE = PREFIX / "share"
STAMP = PREFIX / ".interfaces"
TYPE_SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
"""What the middleware asks for: the first to serialise, the second to describe a type to other systems."""


def main() -> None:
    """Build what is missing or out of date."""
    packages = [package for package in PACKAGES if not _is_installed_elsewhere(package)]
    if not packages:
        return
    if _is_installed_elsewhere("rclpy"):
        names = " ".join(f"ros-{os.environ.get('ROS_DISTRO', 'jazzy')}-{package.replace('_', '-')}" for package in packages)
        raise SystemExit(f"the tests need {' and '.join(packages)}, which this system's ROS 2 lacks: apt install {names}")
    inputs = _digest(packages)
    if STAMP.is_file() and STAMP.read_text() == inputs:
        return
    if lack := _missing_compilers():
        if os.environ.get("NEEDED_TOOLS") == "required":
            raise SystemExit(lack)
        sys.stdout.write(f"{lack}; tests that need these packages are skipped\n")
        return
    STAMP.unlink(missing_ok=True)
    for package in packages:
        sys.stdout.write(f"building {package} for the tests\n")
        with tempfile.TemporaryDirectory() as folder:
            build_package(package, Path(folder))
    STAMP.write_text(inputs)


def build_package(package: str, folder: Path) -> None:
    """Generate, compile and install a package.

    Args:
        package: of ``PACKAGES``.
        folder: empty; for everything that is made on the way.
    """
    generated = generate(package, folder)
    extension = compile_extension(package, folder, generated)
    install(package, folder, extension)


def generate(package: str, folder: Path) -> list[Path]:
    """Write the sources of a package below ``folder/<generator>/<package>``; return those folders.

    The definitions go through ``.idl`` files and type descriptions, which hold the type hashes, in ``folder/idl/<package>``.
    """
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_adapter.srv import convert_srv_to_idl
    from rosidl_generator_type_description import generate_type_hash

    source, idl = PACKAGES[package] / package, folder / "idl" / package
    names = [path.relative_to(source) for path in definitions(package)]
    convert = {".msg": convert_msg_to_idl, ".srv": convert_srv_to_idl}
    with contextlib.redirect_stdout(io.StringIO()):
        for name in names:
            convert[name.suffix](source, package, name, idl / name.parent)
    arguments = {
        "package_name": package,
        "output_dir": str(idl),
        "idl_tuples": [f"{idl}:{name.with_suffix('.idl')}" for name in names],
        "include_paths": [f"{path.parent.name}:{path.parent}" for path in SHARE.glob("*/msg")],
        "target_dependencies": [],
    }
    generate_type_hash(_arguments_file(folder, arguments))
    arguments["type_description_tuples"] = [f"{name.with_suffix('.idl')}:{idl / name.with_suffix('.json')}" for name in names]
    arguments["ros_interface_files"] = [str(source / name) for name in names]
    return [_run_generator(generator, run, package, folder, arguments) for generator, run in _generators().items()]


def definitions(package: str) -> list[Path]:
    """Return the files that define a package's messages and services."""
    return sorted(path for path in (PACKAGES[package] / package).rglob("*") if path.suffix in (".msg", ".srv"))


def compile_extension(package: str, folder: Path, generated: list[Path]) -> Path:
    """Compile the sources of a package into one Python extension; return its path."""
    import numpy

    includes = [path.parent for path in generated] + [
        PREFIX / "include",
        *(path for path in (PREFIX / "include").iterdir() if path.is_dir()),
    ]
    includes += [Path(sysconfig.get_path("include")), Path(numpy.get_include())]
    flags = ["-O0", "-fPIC", "-w", *(f"-I{path}" for path in includes)]
    sources = [path for top in generated for path in sorted(top.rglob("*.c"))]
    together = folder / "together.cpp"  # the C++ files share their headers: one translation unit compiles in a tenth of the time
    together.write_text("".join(f'#include "{path}"\n' for top in generated for path in sorted(top.rglob("*.cpp"))))
    jobs = [["c++", "-std=c++17", *flags, "-c", together, "-o", folder / "together.o"]]
    jobs += [["cc", *flags, "-c", source, "-o", folder / f"{index}.o"] for index, source in enumerate(sources)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(_run, jobs))
    extension = folder / f"{package}_s__rosidl_typesupport_c.so"
    libraries = [path for path in (PREFIX / "lib").glob("lib*.so") if "rosidl" in path.name and not path.is_symlink()]
    libraries.append(PREFIX / "lib" / "libfastcdr.so")
    _run(["c++", "-shared", "-o", extension, *folder.glob("*.o"), "-Wl,--as-needed", *libraries])
    return extension


def install(package: str, folder: Path, extension: Path) -> None:
    """Put a package where Python, the type support and the ament index look for it."""
    module = Path(sysconfig.get_path("platlib"), package)
    share = SHARE / package
    for old in (module, share):
        shutil.rmtree(old, ignore_errors=True)
    shutil.copytree(
        folder / "rosidl_generator_py" / package, module, ignore=lambda _, names: [name for name in names if name.endswith(".c")]
    )
    (module / "__init__.py").touch()
    shutil.copy(extension, module)
    for type_support in TYPE_SUPPORTS:
        library = PREFIX / "lib" / f"lib{package}__{type_support}.so"
        library.unlink(missing_ok=True)
        library.symlink_to(module / extension.name)
    for tree in (folder / "idl" / package, PACKAGES[package] / package):
        shutil.copytree(tree, share, dirs_exist_ok=True)
    index = SHARE / "ament_index" / "resource_index"
    (index / "packages" / package).touch()
    installed = sorted(f"{path.parent.name}/{path.name}" for path in share.glob("*/*"))
    (index / "rosidl_interfaces" / package).write_text("\n".join(installed))


def _generators() -> dict[str, Callable[[str], Any]]:
    """Return the generators by the name of their package; each takes the path of a file of arguments."""
    import rosidl_generator_c
    import rosidl_generator_py
    import rosidl_typesupport_c
    import rosidl_typesupport_fastrtps_c
    import rosidl_typesupport_introspection_c

    return {
        "rosidl_generator_c": rosidl_generator_c.generate_c,
        "rosidl_generator_py": lambda arguments: rosidl_generator_py.generate_py(arguments, ["rosidl_typesupport_c"]),
        "rosidl_typesupport_c": lambda arguments: rosidl_typesupport_c.generate_c(arguments, list(TYPE_SUPPORTS)),
        "rosidl_typesupport_fastrtps_c": rosidl_typesupport_fastrtps_c.generate_typesupport_fastrtps_c,
        "rosidl_typesupport_introspection_c": rosidl_typesupport_introspection_c.generate_c,
    }


def _run_generator(generator: str, run: Callable[[str], Any], package: str, folder: Path, arguments: dict[str, object]) -> Path:
    templates, output = SHARE / generator / "resource", folder / generator / package
    for kind in ("msg", "srv"):
        (output / kind).mkdir(parents=True)
    run(_arguments_file(folder, {**arguments, "template_dir": str(templates), "output_dir": str(output)}))
    for template in templates.glob("*visibility_control.h.in"):
        text = template.read_text().replace("@PROJECT_NAME_UPPER@", package.upper()).replace("@PROJECT_NAME@", package)
        (output / "msg" / template.stem).write_text(text)
    return output


def _arguments_file(folder: Path, arguments: dict[str, object]) -> str:
    path = folder / "arguments.json"
    path.write_text(json.dumps(arguments))
    return str(path)


def _run(words: list[object]) -> None:
    process = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
    if process.returncode:
        raise SystemExit(f"{' '.join(map(str, words))}\nfailed:\n{process.stderr}")


def _missing_compilers() -> str:
    """Return one line on what is missing to build the packages; empty where nothing is."""
    needed = {
        "a C compiler": (shutil.which("cc"), "gcc"),
        "a C++ compiler": (shutil.which("c++"), "g++"),
        "Python's headers": (Path(sysconfig.get_path("include"), "Python.h").is_file(), "python3-dev"),
    }
    missing = {what: package for what, (is_here, package) in needed.items() if not is_here}
    if not missing:
        return ""
    return f"{' and '.join(PACKAGES)} are not built, which needs {' and '.join(missing)}: apt install {' '.join(missing.values())}"


def _is_installed_elsewhere(module: str) -> bool:
    """Return whether a Python module comes from outside this environment, as with a sourced system ROS 2."""
    spec = importlib.util.find_spec(module)
    return spec is not None and spec.origin is not None and not Path(spec.origin).is_relative_to(PREFIX)


def _digest(packages: list[str]) -> str:
    """Return a digest of everything that the result depends on: definitions, this file, the wheels, Python."""
    wheels = sorted(
        f"{wheel.name} {wheel.version}" for wheel in importlib.metadata.distributions() if wheel.name.startswith(("ros-", "numpy"))
    )
    parts = [sys.version, *wheels, Path(__file__).read_text()]
    parts += [f"{path.name}\n{path.read_text()}" for package in packages for path in definitions(package)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


if __name__ == "__main__":
    main()
