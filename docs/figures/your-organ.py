#!/usr/bin/env python3
"""your-organ.py PROGRAMS: draws the pictures of docs/your-organ.md by following the page, with the programs of that folder."""
import os
import subprocess
import sys
import tempfile

from PIL import Image

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


def main():
    with tempfile.TemporaryDirectory(prefix="palpate_page_") as folder:
        subprocess.run([sys.executable, os.path.join(ROOT, "tests/house/run_page.py"), os.path.join(ROOT, "docs/your-organ.md"),
                        folder, sys.argv[1]], check=True)
        for name in ("mesh", "press", "cut"):
            picture = Image.open(os.path.join(folder, "work/my-liver", name + ".png")).convert("RGB")
            picture.thumbnail((900, 700), Image.LANCZOS)
            picture.quantize(256).save(os.path.join(HERE, "your-organ-%s.png" % name), optimize=True)


if __name__ == "__main__":
    main()
