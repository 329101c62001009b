"""check_shared_library.py LIBRARY ABI_LIST [TOOLS]: a shared libpalpate shows the functions of the list and no other, all
under one version; needs libc and libm alone, and of libm only functions that every platform computes exactly; and is small.
TOOLS: what the names of the binary tools begin with, for another platform: aarch64-linux-gnu-."""
import pathlib
import re
import subprocess
import sys
import tempfile

library, abi_list = map(pathlib.Path, sys.argv[1:3])
tools = sys.argv[3] if len(sys.argv) > 3 else ""
MOST_BYTES = 1_690_000
failures = []


def lines_of(tool, *arguments):
    return subprocess.run([tools + tool, *arguments], check=True, capture_output=True, text=True).stdout.splitlines()


abi = re.search(r"^constant PALPATE_API_VERSION (\d+)$", abi_list.read_text(), re.M)[1]
functions = re.findall(r"^function .*?(\w+)\(", abi_list.read_text(), re.M)
wanted = {f"{name}@@PALPATE_{abi}" for name in functions} | {f"PALPATE_{abi}"}
shown = {line.split()[-1] for line in lines_of("nm", "-D", "--defined-only", "--with-symbol-versions", library)}
for symbol in sorted(shown ^ wanted):
    failures.append(f"{symbol} is {'shown' if symbol in shown else 'not shown'}; expected the functions of {abi_list.name}")

dynamic = lines_of("readelf", "-dW", library)
needed = {re.search(r"\[(.*)\]", line)[1] for line in dynamic if "(NEEDED)" in line}
if not needed <= {"libc.so.6", "libm.so.6", "ld-linux-aarch64.so.1"}:
    failures.append(f"needs {', '.join(sorted(needed))}; expected libc and libm alone")
soname = [re.search(r"\[(.*)\]", line)[1] for line in dynamic if "(SONAME)" in line]
if soname != [f"libpalpate.so.{abi}"]:
    failures.append(f"is named {soname}; expected libpalpate.so.{abi}, after PALPATE_API_VERSION")

# A function that one C library rounds otherwise than another would give other bits on another platform: the fma and the sqrt of
# mingw-w64 do. The compiler's own instruction computes sqrt.
MATHEMATICS = set("""acos acosh asin asinh atan atan2 atanh cbrt cos cosh erf erfc exp exp2 expm1 fma hypot lgamma log log10 log1p
log2 pow sin sinh sqrt tan tanh tgamma""".split())
undefined = {line.split()[-1].split("@")[0] for line in lines_of("nm", "-D", "--undefined-only", library)}
for symbol in sorted(undefined & (MATHEMATICS | {name + "f" for name in MATHEMATICS})):
    failures.append(f"calls {symbol}, whose last digit belongs to the C library; compute it in the runtime (base/exponential.h)")

# Weak symbols of the compiler's start files have no version; needed symbols have that of their library.
for line in lines_of("nm", "-D", "--undefined-only", "--with-symbol-versions", library):
    kind, symbol = line.split()
    if kind != "w" and "@GLIBC_" not in symbol:
        failures.append(f"needs {symbol}, which no version of libc promises")

with tempfile.TemporaryDirectory() as folder:
    stripped = pathlib.Path(folder, "stripped.so")
    subprocess.run([tools + "strip", "-o", stripped, library], check=True)
    size = stripped.stat().st_size
print(f"{len(functions)} functions, {size} bytes stripped, needs {', '.join(sorted(needed))}")
if size >= MOST_BYTES:
    failures.append(f"has {size} bytes stripped; expected fewer than {MOST_BYTES}")

print("\n".join(f"{library}: {failure}" for failure in failures))
sys.exit(3 if failures else 0)
