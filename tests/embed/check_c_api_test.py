"""check_c_api_test.py MAP TEST: each function of the C API (MAP, palpate.map) is called in TEST; one that fills a struct with defaults by
its inline form. Exit code 1 and their names where one is not."""
import pathlib
import re
import sys

functions = re.findall(r"^\s+(palpate_\w+);", pathlib.Path(sys.argv[1]).read_text(), re.M)
test = pathlib.Path(sys.argv[2]).read_text()
inline = {"palpate_bundle_fill_info": "palpate_bundle_describe"}
called = {name: inline.get(name, name.replace("palpate_init_", "palpate_default_")) + "(" for name in functions}
missing = [name for name, call in called.items() if call not in test and name + "(" not in test]
if not functions or missing:
    sys.exit(f"{sys.argv[2]}: expected a call of each of the {len(functions)} functions of {sys.argv[1]}, found none of: {', '.join(missing)}")
