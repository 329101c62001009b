"""Builds the wheel for `pip install bindings/python` (PEP 517): CMake builds the runtime and the module, and what it installs
is packed. It needs CMake, Ninja or make, a C++20 compiler and pybind11's headers, and neither the network nor setuptools.
config_settings: each key and value becomes -Dkey=value for CMake."""
import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def version():
    return re.search(r"project\(palpate VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def metadata():
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {project['name']}",
        f"Version: {version()}",
        f"Summary: {project['description']}",
        f"License: {project['license']['text']}",
        f"Requires-Python: {project['requires-python']}",
        *(f"Requires-Dist: {name}" for name in project["dependencies"]),
        "Description-Content-Type: text/markdown",
    ]
    return "\n".join(lines) + "\n\n" + (HERE / project["readme"]).read_text()


def install_package(folder, settings):
    """The package by CMake, with the runtime inside the module."""
    build = folder / "build"
    options = {
        "CMAKE_BUILD_TYPE": "Release",
        "BUILD_SHARED_LIBS": "OFF",
        "PALPATE_BUILD_OFFLINE": "OFF",
        "PALPATE_BUILD_TESTS": "OFF",
        "PALPATE_BUILD_PYTHON": "ON",
        "PALPATE_PYTHON_DIR": "package",
        "Python_EXECUTABLE": sys.executable,
        **(settings or {}),
    }
    command = ["cmake", "-S", ROOT, "-B", build, *(f"-D{key}={value}" for key, value in options.items())]
    subprocess.run(command, check=True)
    subprocess.run(["cmake", "--build", build, "--target", "palpate_python", "-j", str(os.cpu_count())], check=True)
    subprocess.run(["cmake", "--install", build, "--component", "python", "--strip", "--prefix", folder], check=True)
    return folder / "package"


def write_wheel(wheel, package):
    """A zip with the package, what it is, and the hash of every file."""
    info = f"palpate-{version()}.dist-info"
    record = []
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:

        def add(name, content):
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(content)}")
            archive.writestr(name, content)

        for path in sorted(p for p in package.rglob("*") if p.is_file()):
            add(path.relative_to(package).as_posix(), path.read_bytes())
        add(f"{info}/LICENSE", (ROOT / "LICENSE").read_bytes())
        add(f"{info}/METADATA", metadata().encode())
        kind = f"Wheel-Version: 1.0\nGenerator: palpate\nRoot-Is-Purelib: false\nTag: {tag()}\n"
        add(f"{info}/WHEEL", kind.encode())
        archive.writestr(f"{info}/RECORD", "\n".join([*record, f"{info}/RECORD,,"]) + "\n")


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    folder = pathlib.Path(metadata_directory, f"palpate-{version()}.dist-info")
    folder.mkdir()
    (folder / "METADATA").write_text(metadata())
    return folder.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = f"palpate-{version()}-{tag()}.whl"
    with tempfile.TemporaryDirectory() as folder:
        package = install_package(pathlib.Path(folder), config_settings)
        write_wheel(pathlib.Path(wheel_directory, name), package)
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise RuntimeError("palpate has no source archive of its own: build it from the source tree, pip install bindings/python")
