"""read_with_h5py.py WRITE_TINY_BUNDLE BUNDLE_MD PALPATE_BUNDLE: a bundle seen by h5py, by an index reader in Python, and by the snippet of
BUNDLE.md, which must all tell the same."""
import json
import re
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy

WRITER, DOCUMENT, PROGRAM = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
KINDS = {1: "<f8", 2: "<f4", 3: "<i4", 4: "u1", 5: "S1", 6: "<f2"}


def read_index(data):
    """The index as BUNDLE.md describes it: {id: (type, shape, offset, bytes)}."""
    magic, version, count, file_bytes = struct.unpack_from("<8sIIQ", data, 0)
    assert magic == b"PALPATE\n" and version == 2 and file_bytes == len(data)
    sections = {}
    for i in range(count):
        fields = struct.unpack_from("<IIII4QQQQ", data, 64 + 72 * i)
        sections[fields[0]] = (fields[1], fields[4 : 4 + fields[2]], fields[8], fields[9])
    return sections


class Bundle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = Path(cls.folder.name) / "liver.h5"
        subprocess.run([WRITER, cls.path], check=True)
        cls.data = cls.path.read_bytes()
        cls.file = h5py.File(cls.path, "r")

    @classmethod
    def tearDownClass(cls):
        cls.file.close()
        cls.folder.cleanup()

    def test_h5py_finds_the_sections_of_the_document(self):
        table = re.findall(r"^\| (\d+) \| `([^`]+)` \| ([\w, ]+) \| (\([^|]*\)) \| ([^|]*) \| (\w+) \|", DOCUMENT.read_text(), re.M)
        self.assertGreater(len(table), 15)
        index = read_index(self.data)
        for number, path, kind, shape, unit, presence in table:
            if int(number) not in index:
                self.assertEqual(presence, "optional", path)
                continue
            data = self.file[path]
            code, lengths, offset, count = index[int(number)]
            raw = numpy.frombuffer(self.data[offset : offset + count], KINDS[code])
            if kind == "text":
                self.assertEqual(data.asstr()[()], raw.tobytes().decode())
            else:
                self.assertEqual(data.shape, tuple(lengths), path)
                numpy.testing.assert_array_equal(data[()].ravel(), raw)
            self.assertEqual(data.attrs["unit"], unit.strip())
            self.assertEqual(data.attrs["shape"], shape.strip())
            self.assertEqual(data.id.get_offset(), offset)
            self.assertEqual(offset % 4096, 0)

    def test_attributes_and_provenance_tell_the_same_in_natural_types(self):
        attributes = {key: value for key, value in self.file.attrs.items()}
        self.assertEqual(attributes, json.loads(self.file["provenance"].asstr()[()]))
        self.assertEqual(attributes["format"], "palpate bundle")
        self.assertIsInstance(attributes["organ"], str)
        self.assertIs(bool(attributes["preload"]), False)
        self.assertEqual(attributes["tolerance"], 1e-12)
        self.assertEqual(self.file["certificate"].attrs["solver"], attributes["solver"])

    def test_the_snippet_of_the_document_runs_and_is_right(self):
        snippets = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(), re.S)
        self.assertEqual(len(snippets), 2)
        self.assertLessEqual(len(snippets[0].strip().splitlines()), 6)
        names = {}
        exec(snippets[0].replace("liver.h5", str(self.path)), names)  # the document's own words
        field, force, node = names["field"], names["force"], names["node"]
        # Pulling a node by 1 mm along x moves that node by 1 mm along x, and takes T^f times that.
        numpy.testing.assert_allclose(field[node], [1e-3, 0, 0], atol=1e-9)  # 1 mm times f32's rounding
        numpy.testing.assert_allclose(force, self.file["tensors/force"][0] @ [1e-3, 0, 0])
        self.assertGreater(force[0], 0)

    def test_the_document_decodes_every_form(self):
        snippets = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(), re.S)
        names = {"numpy": numpy}
        exec(snippets[1], names)
        long = Path(self.folder.name) / "long.h5"
        subprocess.run([WRITER, long, "long"], check=True)
        source = h5py.File(long, "r")
        self.addCleanup(source.close)
        for options in (["--precision", "f16"], ["--low-rank", "1e-4"], ["--low-rank", "1e-2", "--precision", "f16"]):
            packed = Path(self.folder.name) / "packed.h5"
            subprocess.run([PROGRAM, "pack", long, "-o", packed, *options], check=True, capture_output=True)
            with h5py.File(packed, "r") as file:
                if "--low-rank" in options:
                    self.assertGreater(file["tensors/compliance/blocks"][:, 4].max(), 1)
                errors = []
                for k in range(len(file["tensors/nodes"])):
                    expected = source["tensors/displacement_surface"][k].astype(float)
                    found = names["displacement"](file, k)
                    self.assertEqual(found.shape, expected.shape)
                    size = numpy.linalg.norm(expected, axis=(1, 2))
                    errors += list(numpy.linalg.norm(found - expected, axis=(1, 2))[size > 0] / size[size > 0])
                # The interior is not in these norms: the surface's may be a little above the column's. Halves and blocks
                # are read exactly, so that the worst is the stated one but for that.
                self.assertLessEqual(max(errors), 1.5 * file.attrs["pack_error_worst"], options)
                self.assertGreater(max(errors), 0.5 * file.attrs["pack_error_worst"], options)
            packed.unlink()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
