"""count_tests.py LOG: prints how many tests passed, failed and were skipped in the run that CTest has written down in
BUILD/Testing/Temporary/LastTest.log. A suite of GoogleTest counts with its tests, any other entry as one."""
import collections
import re
import sys

counts = collections.Counter()
with open(sys.argv[1], errors="replace") as log:
    entries = re.split(r"^\d+/\d+ Testing: ", log.read(), flags=re.M)[1:]
for entry in entries:
    passed, failed, skipped = (sum(int(n) for n in re.findall(pattern, entry, re.M)) for pattern in (
        r"^\[  PASSED  \] (\d+) tests?\.$", r"^\[  FAILED  \] (\d+) tests?, listed below:$",
        r"^\[  SKIPPED \] (\d+) tests?, listed below:$"))
    if passed + failed + skipped == 0 or re.search(r"^Test Failed\.$", entry, re.M) and failed == 0:
        failed += bool(re.search(r"^Test Failed\.$", entry, re.M))
        skipped += bool(re.search(r"^Test (Skipped|Not Run)", entry, re.M))
        passed += bool(re.search(r"^Test Passed\.$", entry, re.M))
    counts.update(passed=passed, failed=failed, skipped=skipped)
print(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped")
