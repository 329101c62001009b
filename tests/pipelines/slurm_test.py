#!/usr/bin/env python3
"""Runs pipelines/slurm on the Slurm of SLURM_CONF. Usage: one-machine-slurm.sh slurm_test.py BIN [TEST ...]"""
import glob
import os
import re
import subprocess
import time
import unittest

from pipeline_test import BIN, ROOT, InFolder, make, read_bytes, write_ellipsoid  # takes BIN off the command line

TWO_RANKS = ["--ntasks-per-node=2", "--mem=2G"]


def output_of(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


class Job:
    """A submitted job and its log, which all its runs write to."""

    def __init__(self, data, options, case, **environment):
        self.folder = os.path.dirname(data)
        self.data = data
        self.id = output_of("env", "-C", ROOT, "BIN=" + BIN, "DATA=" + data,
                            *("%s=%s" % item for item in environment.items()), "sbatch", "--parsable", *options,
                            "--output=" + os.path.join(self.folder, "%j.log"), "pipelines/slurm/organ.sbatch", *case).strip()

    def field(self, name):
        words = output_of("scontrol", "show", "job", "--oneliner", self.id).split()
        return [word.split("=", 1)[1] for word in words if word.startswith(name + "=")]

    def wait_until(self, condition, what, seconds):
        deadline = time.time() + seconds
        while not condition():
            if time.time() > deadline:
                raise AssertionError("no %s within %d s; job %s is %s:\n%s"
                                     % (what, seconds, self.id, self.field("JobState"), self.log()))
            time.sleep(0.05)

    def progress(self):
        """The percentages of solved columns that the log has so far."""
        return [0] + [int(said) for said in re.findall(r"columns: (\d+) %", self.log())]

    def start_now(self):
        """Slurm lets a requeued job wait for two minutes; here it may start after a few seconds."""
        self.wait_until(lambda: self.field("JobState") == ["PENDING"], "requeued job", 20)
        time.sleep(3)  # slurmd refuses a start in the same second in which it revoked the credential of the job's last start
        subprocess.run(["scontrol", "update", "JobId=" + self.id, "StartTime=now"], check=True)

    def wait(self):
        """The states of the job or of an array's tasks, once all have ended."""
        ended = {"COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL"}
        self.wait_until(lambda: ended.issuperset(self.field("JobState")), "end of the job", 300)
        return self.field("JobState")

    def log(self):
        return "".join(read_bytes(file).decode() for file in sorted(glob.glob(self.folder + "/*.log")))


class Slurm(InFolder):
    def plain(self, bundle, *more):
        """The bytes of the same bundle without Slurm, on one rank."""
        make(self.data + "-plain", *more, os.path.join(self.data + "-plain", bundle))
        return read_bytes(self.data + "-plain", bundle)

    def ellipsoid(self, triangles=500):
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        return ["IMAGE=" + image, "SURFACE_OPTIONS=--labels 255 --smooth 4 --triangles %d" % triangles,
                "TETRAHEDRA_OPTIONS=--region liver"]

    def test_a_job_on_two_ranks_gives_the_bytes_of_a_plain_run(self):
        job = Job(self.data, TWO_RANKS, ["plate", "corners", "5mm"])
        self.assertEqual(job.wait(), ["COMPLETED"], job.log())
        self.assertIn("--memory 2.147", job.log())  # 2 GiB
        self.assertIn("each of 2 ranks", job.log())
        self.assertEqual(read_bytes(self.data + "/plate/5mm/corners/bundle.h5"),
                         self.plain("plate/5mm/corners/bundle.h5", "ORGAN=plate"))
        self.assertTrue(os.path.exists(self.data + "/plate/5mm/corners/scenes/one-contact/summary.json"))

    def test_ranks_started_by_mpiexec_inside_the_allocation(self):
        job = Job(self.data, TWO_RANKS, ["plate", "corners", "5mm"], LAUNCH="mpiexec --bind-to none")
        self.assertEqual(job.wait(), ["COMPLETED"], job.log())
        self.assertIn("each of 2 ranks", job.log())  # as many as Slurm allotted, without -n

    def test_an_array_of_boundary_sets_makes_their_mesh_once(self):
        cases = os.path.join(self.folder.name, "cases")
        image = self.ellipsoid()[0]
        with open(cases, "w") as file:
            for boundary in ("right-side", "diaphragm"):
                file.write("liver %s 1700 %s SURFACE_OPTIONS=--triangles=500\n" % (boundary, image))
        job = Job(self.data, [*TWO_RANKS, "--array=1-2"], [cases])
        self.assertEqual(job.wait(), ["COMPLETED"] * 2, job.log())
        self.assertEqual(len(glob.glob(self.data + "/liver/1700/*/verified.json")), 2)
        self.assertEqual(job.log().count("palpate-tetrahedra %s/liver" % self.data), 1)

    def test_requeued_in_the_middle_it_resumes_to_the_same_bytes(self):
        # CG with PETSc's multigrid solves one column after another, so slowly that the requeue comes in the middle.
        slow = [*self.ellipsoid(triangles=900), "PRECOMPUTE_OPTIONS=--batch 24 -- -column_pc_type gamg"]
        bundle = "liver/1700/right-side/bundle.h5"
        job = Job(self.data, TWO_RANKS, ["liver", "right-side", "1700", *slow])
        # The first requeue is an operator's; the second is the job's own, which the signal of a nearly expired time limit causes.
        for percent, requeue in ((15, ["scontrol", "requeue", job.id]),
                                 (40, ["scancel", "--signal=USR1", "--batch", job.id])):
            job.wait_until(lambda: max(job.progress()) >= percent, "%d %% of the columns" % percent, 300)
            subprocess.run(requeue, check=True)
            job.start_now()
        self.assertEqual(job.wait(), ["COMPLETED"], job.log())
        self.assertEqual(job.field("Restarts"), ["2"])
        resumed = re.findall(r"is resumed: (\d+) of (\d+) batches", job.log())
        (first, of), (second, _) = ((int(done), int(of)) for done, of in resumed)
        self.assertTrue(0.1 * of < first < second < of, resumed)
        self.assertEqual(read_bytes(self.data, bundle), self.plain(bundle, *slow))

    def test_bad_input_fails_the_job_with_a_sentence(self):
        for case, sentence in ((["plate", "nowhere", "5mm"], "expected one of corners"),
                               (["plate", "corners"], "expected ORGAN BC RESOLUTION"),
                               (["plate"], "which of its lines?")):
            job = Job(self.data, TWO_RANKS, case)
            self.assertEqual(job.wait(), ["FAILED"])
            self.assertIn(sentence, job.log())


if __name__ == "__main__":
    unittest.main(verbosity=2)
