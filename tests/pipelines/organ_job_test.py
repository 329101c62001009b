#!/usr/bin/env python3
"""pipelines/slurm/organ.sbatch as bash runs it, without Slurm and with a make that only tells what it is asked; and rules that many jobs run at
once, with the real make."""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
MAKE = """#!/bin/bash
echo "${@:3}" >> "$MAKE_LOG"
"""


class OrganJob(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="palpate_organ_job_")
        self.log = self.path("log")
        os.mkdir(self.path("bin"))
        with open(self.path("bin", "make"), "w") as file:
            file.write(MAKE)
        os.chmod(file.name, 0o755)

    def tearDown(self):
        self.folder.cleanup()

    def path(self, *names):
        return os.path.join(self.folder.name, *names)

    def write(self, name, text):
        with open(self.path(name), "w", newline="") as file:
            file.write(text)
        return file.name

    def job(self, *words, task=None, **more):
        """The exit code, what make was asked, line by line, and what the job said."""
        environment = dict(os.environ, SLURM_SUBMIT_DIR=ROOT, DATA=self.path("data"), MAKE_LOG=self.log,
                           PATH=self.path("bin") + ":" + os.environ["PATH"], **more)
        environment.pop("SLURM_ARRAY_TASK_ID", None)
        if task is not None:
            environment["SLURM_ARRAY_TASK_ID"] = str(task)
        self.write("log", "")
        run = subprocess.run(["bash", os.path.join(ROOT, "pipelines", "slurm", "organ.sbatch"), *words], env=environment,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        with open(self.log) as file:
            return run.returncode, file.read().splitlines(), run.stdout

    def test_the_last_line_of_the_cases_needs_no_end(self):
        for end, line_end in (("", "\n"), ("\n", "\n"), ("", "\r\n"), ("\r\n", "\r\n")):
            cases = self.write("cases", line_end.join(("liver right-side 1700", "plate corners 5mm RANKS=2")) + end)
            for task, case in ((1, "ORGAN=liver BC=right-side RESOLUTION=1700"),
                               (2, "ORGAN=plate BC=corners RESOLUTION=5mm RANKS=2")):
                code, asked, said = self.job(cases, task=task)
                self.assertEqual((code, asked), (0, [case + " mesh", case + " MESH_IS_MADE=1 PICTURES="]), said)

    def test_a_container_has_make_and_the_programs(self):
        image = self.write("palpate.sif", "")
        container = self.write("apptainer", '#!/bin/bash\necho "$@" >> "$MAKE_LOG"; shift 2; exec "$@"\n')
        os.chmod(container, 0o755)
        code, asked, said = self.job("liver", "right-side", "1700", CONTAINER="%s exec %s" % (container, image), LAUNCH="", RANKS="1")
        case = "ORGAN=liver BC=right-side RESOLUTION=1700"
        words = [case + " mesh", case + " MESH_IS_MADE=1 PICTURES="]
        self.assertEqual((code, asked), (0, [line for asks in words for line in ("exec %s make -f pipelines/built.mk %s" % (image, asks), asks)]), said)

    def test_a_line_that_is_not_there_is_refused(self):
        cases = self.write("cases", "liver right-side 1700\n\nplate corners 5mm")
        for task, sentence in ((4, "no line 4"), (0, "no line 0"),
                               (2, "found ''"), (None, "--array=1-3")):
            code, asked, said = self.job(cases, task=task)
            self.assertEqual((code, asked), (2, []), said)
            self.assertIn(sentence, said)
        self.assertIn("that can be read", self.job(self.path("none"), task=1)[2])


class JobsAtOnce(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="palpate_jobs_at_once_")

    def tearDown(self):
        self.folder.cleanup()

    def start(self, *words):
        return subprocess.Popen(["make", "-C", ROOT, "-f", "pipelines/built.mk", "BIN=" + self.folder.name,
                                 "DATA=" + self.folder.name, "ORGAN=plate", *words],
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def start_options(self, *words):
        return self.start(os.path.join(self.folder.name, "plate", "5mm", "mesh-options.txt"), *words)

    def options(self, *words):
        run = self.start_options(*words)
        said = run.communicate()[0]
        return run.returncode, said

    def test_what_the_mesh_is_made_by_is_whole_at_every_moment(self):
        # A long value, so that writing it takes long enough to be seen in the middle.
        words = ["TETRAHEDRA_OPTIONS=" + " ".join("--grade %d" % i for i in range(6000)), "RESOLUTION=5mm"]
        code, said = self.options(*words)
        self.assertEqual(code, 0, said)
        file = os.path.join(self.folder.name, "plate", "5mm", "mesh-options.txt")
        before = os.stat(file)
        with open(file) as stream:
            text = stream.read()
        for _ in range(3):
            for run in [self.start_options(*words) for _ in range(6)]:
                said = run.communicate()[0]
                self.assertEqual(run.returncode, 0, said)
        with open(file) as stream:
            self.assertEqual(stream.read(), text)
        after = os.stat(file)  # nobody found it changed, and replaced it
        self.assertEqual((after.st_ino, after.st_mtime_ns), (before.st_ino, before.st_mtime_ns))
        self.assertEqual(os.listdir(os.path.dirname(file)), ["mesh-options.txt"])

    def test_a_job_without_the_lock_does_not_make_the_mesh_of_other_options(self):
        self.assertEqual(self.options("TETRAHEDRA_OPTIONS=--grade 1")[0], 0)
        code, said = self.options("TETRAHEDRA_OPTIONS=--grade 2", "MESH_IS_MADE=1")
        self.assertNotEqual(code, 0)
        self.assertIn("mesh-options.txt: ", said)
        self.assertEqual(self.options("TETRAHEDRA_OPTIONS=--grade 1", "MESH_IS_MADE=1")[0], 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
