"""make_package.py SOURCE OUT LINUX_LIBRARY [WINDOWS_DLL]: the package for Unity as a folder, OUT/package, and as a file, OUT/com.palpate.runtime-VERSION.tgz,
which Unity's package manager installs."""
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

NAME = "com.palpate.runtime"
# Unity ignores a file of an installed package that has no .meta file. The same path has the same guid in every version.
META = "fileFormatVersion: 2\nguid: {guid}\n"
FOLDER = "folderAsset: yes\n"
PLUGIN = """PluginImporter:
  serializedVersion: 2
  isPreloaded: 0
  isOverridable: 0
  platformData:
  - first:
      Any:
    second:
      enabled: 0
  - first:
      Editor: Editor
    second:
      enabled: 1
      settings:
        CPU: x86_64
        OS: {system}
  - first:
      Standalone: {standalone}
    second:
      enabled: 1
      settings:
        CPU: x86_64
"""
PLUGINS = {"libpalpate.so": ("Linux", "Linux64"), "palpate.dll": ("Windows", "Win64")}


def write_meta(path, package):
    name = path.relative_to(package).as_posix()
    text = META.format(guid=hashlib.md5(f"{NAME}/{name}".encode()).hexdigest())
    if path.is_dir():
        text += FOLDER
    if path.name in PLUGINS:
        system, standalone = PLUGINS[path.name]
        text += PLUGIN.format(system=system, standalone=standalone)
    path.with_name(path.name + ".meta").write_text(text)


def main():
    source, out, linux = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    here, package = source / "bindings/csharp", out / "package"
    version = re.search(r"project\(palpate VERSION ([\d.]+)", (source / "CMakeLists.txt").read_text())[1]
    shutil.rmtree(package, ignore_errors=True)
    shutil.copytree(here / "Runtime", package / "Runtime")
    shutil.copytree(here / "Samples~", package / "Samples~")
    shutil.copytree(source / "runtime/include/palpate", package / "Documentation~", ignore=shutil.ignore_patterns("*.hpp"))
    native = subprocess.run([sys.executable, here / "generate.py", source / "runtime/abi_3.txt", source / "runtime/include"],
                            check=True, capture_output=True, text=True).stdout
    (package / "Runtime/Native.cs").write_text(native)
    (package / "package.json").write_text((here / "package.json.in").read_text().replace("@VERSION@", version))
    shutil.copy(here / "README.md", package / "README.md")
    shutil.copy(source / "LICENSE", package / "LICENSE.md")
    plugins = package / "Plugins/x86_64"
    plugins.mkdir(parents=True)
    shutil.copy(linux, plugins / "libpalpate.so")
    for dll in sys.argv[4:]:
        shutil.copy(dll, plugins / "palpate.dll")
    # Unity does not import folders whose names end in ~.
    imported = [path for path in package.rglob("*") if not any(part.endswith("~") for part in path.relative_to(package).parts)]
    for path in imported:
        write_meta(path, package)
    with tarfile.open(out / f"{NAME}-{version}.tgz", "w:gz") as archive:
        archive.add(package, "package")


main()
