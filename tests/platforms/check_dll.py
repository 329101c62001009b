"""check_dll.py PREFIX ABI_LIST TOOLS: the installed Windows library shows the functions of the list and no other, needs nothing that
Windows does not have, and is named after the ABI; the import library names it. TOOLS: x86_64-w64-mingw32-."""
import pathlib
import re
import subprocess
import sys

prefix, abi_list, tools = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
failures = []
abi = re.search(r"^constant PALPATE_API_VERSION (\d+)$", abi_list.read_text(), re.M)[1]
functions = set(re.findall(r"^function .*?(\w+)\(", abi_list.read_text(), re.M))
name = f"libpalpate-{abi}.dll"

found = sorted(path.name for path in (prefix / "bin").iterdir())
if found != [name]:
    sys.exit(f"{prefix}/bin has {', '.join(found)}; expected {name}, after PALPATE_API_VERSION, and nothing else")
printed = subprocess.run([tools + "objdump", "-p", prefix / "bin" / name], check=True, capture_output=True, text=True).stdout

needed = set(re.findall(r"DLL Name: (\S+)", printed))
if not needed or not needed <= {"KERNEL32.dll", "msvcrt.dll"}:
    failures.append(f"needs {', '.join(sorted(needed))}; expected KERNEL32.dll and msvcrt.dll, which every Windows has")
shown = set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\] +[0-9a-f]+ )?(\w+)$", printed, re.M))
for symbol in sorted(shown ^ functions):
    failures.append(f"{symbol} is {'shown' if symbol in shown else 'not shown'}; expected the functions of {abi_list.name}")

imported = subprocess.run([tools + "dlltool", "-I", prefix / "lib/libpalpate.dll.a"], check=True, capture_output=True, text=True)
if imported.stdout.split() != [name]:
    failures.append(f"the import library leads to {imported.stdout.strip()}; expected {name}")

print(f"{len(shown)} functions, {(prefix / 'bin' / name).stat().st_size} bytes, needs {', '.join(sorted(needed))}")
print("\n".join(f"{name}: {failure}" for failure in failures))
sys.exit(3 if failures else 0)
