#!/usr/bin/env python3
"""Runs the scripts of examples/engines as users do, and compares what comes out with one process's:

    engines_test.py ENGINE PROGRAM SOURCE      ENGINE: slurm, snakemake or dask

Exit code 77, with a line that says why, where the engine is not installed here.
"""

import filecmp
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
PARTS = 3
MODEL = """format = "model/1"
name = "ring"
[object]
surface = "rest.ply"
mass = 0.456
density = 125.08274712027816
[material]
youngs_modulus = 4000.0
poissons_ratio = 0.39
mass_damping = 0.5
stiffness_damping = 0.0035
[world]
gravity = [0.0, -9.81, 0.0]
[timing]
frame_rate = 60.0
frame_count = 10
start_frame = 0
[simulation]
cell_size = 0.04
grid_origin = [0.0, 0.0, 0.0]
substeps = 4
newmark_theta = 0.51
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
"""
SETTINGS = ["cells=8", "coarse_cells=6", "points_per_frame=100", "scan_per_decade=1", "starts=1", "steps=0.4", "max_iterations=40",
            "budget=0", "alternatives=false"]


def skip(why):
    print("skipped:", why)
    sys.exit(SKIPPED)


def run(words, **more):
    print("+", *words, flush=True)
    return subprocess.run([str(w) for w in words], **more)


def must(words, **more):
    done = run(words, **more)
    if done.returncode != 0:
        sys.exit(f"exit code {done.returncode} of {words}")


def python_with(module):
    """A Python that has a module: this one, or that of Debian's packages; nothing where neither has."""
    return next((p for p in [sys.executable, "/usr/bin/python3"]
                 if pathlib.Path(p).exists() and subprocess.run([p, "-c", f"import {module}"], capture_output=True).returncode == 0), None)


def dask(script, program, out, command, folder):
    python = python_with("dask.distributed")
    if not python:
        skip("no Python here has dask.distributed: apt-get install python3-distributed")
    must([python, script / "dask_parts.py", "--parts", PARTS, "--workers", 2, "--pliant", program, "--", *command, "--out", out], cwd=folder)


def snakemake(script, program, out, command, folder):
    if not shutil.which("snakemake"):
        skip("no snakemake here: apt-get install snakemake")
    # Some of its versions write into the user's folder for caches.
    own = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"), HOME=str(folder))
    told = " ".join("'" + word + "'" for word in command[1:])
    must(["snakemake", "--snakefile", script / "Snakefile", "--cores", 2, "--config", f"parts={PARTS}", f"out={out}", f"pliant={program}",
          f"command={command[0]} {told}"], cwd=folder, env=own)
    shutil.rmtree(pathlib.Path(out) / ".snakemake-parts")


class Slurm:
    """A cluster of this machine alone, in a temporary folder; its daemons end with it."""

    def __init__(self, folder):
        self.folder = folder
        self.processes = []
        host = socket.gethostname().split(".")[0]
        for name in ["state", "spool", "munge"]:
            (folder / name).mkdir(mode=0o700)
        key = folder / "munge/key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self.munge = folder / "munge/socket"
        ports = []
        for _ in range(2):
            with socket.socket() as s:
                s.bind(("127.0.0.1", 0))
                ports.append(s.getsockname()[1])
        cores = len(os.sched_getaffinity(0))
        (folder / "slurm.conf").write_text(f"""ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={self.munge}
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES State=UP
""")
        # Where Slurm and its daemons look for plugins' files of their own.
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\nIgnoreSystemd=yes\n")
        self.environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"))

    def start(self):
        self.daemon(["munged", "--foreground", "--force", f"--key-file={self.folder}/munge/key", f"--socket={self.munge}",
                     f"--pid-file={self.folder}/munge/pid", f"--log-file={self.folder}/munge/log", f"--seed-file={self.folder}/munge/seed"])
        self.wait(lambda: self.munge.exists(), "munged")
        self.daemon(["slurmctld", "-D", "-i"])
        self.daemon(["slurmd", "-D"])
        self.wait(lambda: "idle" in self.ask(["sinfo", "--noheader", "--format=%T"]), "slurmctld and slurmd")

    def daemon(self, words):
        log = open(self.folder / (words[0] + ".out"), "w")
        self.processes.append(subprocess.Popen(words, env=self.environment, stdout=log, stderr=log))

    def ask(self, words):
        return subprocess.run(words, env=self.environment, capture_output=True, text=True).stdout

    def wait(self, is_so, what):
        for _ in range(150):
            if is_so():
                return
            time.sleep(0.2)
        for file in sorted(self.folder.glob("*.log")) + sorted(self.folder.glob("*.out")) + sorted(self.folder.glob("munge/log")):
            print(f"-- {file.name}\n{file.read_text()[-3000:]}")
        self.stop()
        skip(f"{what} did not come up here; what they said stands above")

    def stop(self):
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def slurm(script, program, out, command, folder):
    for word in ["munged", "slurmctld", "slurmd", "sbatch"]:
        if not shutil.which(word) and not pathlib.Path("/usr/sbin", word).exists():
            skip(f"no {word} here: apt-get install slurm-wlm munge")
    if os.geteuid() != 0:
        skip("a cluster of one's own needs root")
    os.environ["PATH"] += ":/usr/sbin"
    cluster = Slurm(pathlib.Path(tempfile.mkdtemp(prefix="pliant-slurm-")))
    cluster.start()
    try:
        said = subprocess.run(["sbatch", "--wait", "--parsable", f"--array=1-{PARTS}", "--cpus-per-task=1", f"--output={folder}/slurm-%a.txt",
                               f"--chdir={folder}", str(script / "slurm.sh"), *map(str, command), "--out", str(out)],
                              env=dict(cluster.environment, PLIANT=str(program)), capture_output=True, text=True, timeout=300)
        for part in range(1, PARTS + 1):
            print(f"-- task {part}\n{(folder / f'slurm-{part}.txt').read_text()}")
        print(cluster.ask(["sinfo", "--version"]))
        if said.returncode != 0:
            sys.exit(f"sbatch: {said.returncode}: {said.stdout}{said.stderr}")
    finally:
        cluster.stop()
        shutil.rmtree(cluster.folder, ignore_errors=True)


def leave_model(source, folder):
    """A coarse ring as a fit would leave it, and a table of eight materials."""
    (folder / "fit").mkdir()
    (folder / "fit/model.toml").write_text(MODEL)
    shutil.copy(source / "examples/oracle-bounce-a/rest.ply", folder / "fit")
    rows = "".join(f"{2000 + 500 * k}\n" for k in range(8))
    (folder / "materials.csv").write_text("youngs_modulus [Pa]\n" + rows)


def same(one, other):
    """Names of files of which two folders differ."""
    names = {p.relative_to(d) for d in (one, other) for p in d.rglob("*") if p.is_file()}
    return sorted(str(n) for n in names if not ((one / n).is_file() and (other / n).is_file() and filecmp.cmp(one / n, other / n, shallow=False)))


def main():
    engine, program, source = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    with tempfile.TemporaryDirectory(prefix="pliant-engines-") as name:
        folder = pathlib.Path(name)
        leave_model(source, folder)
        ensemble = ["ensemble", "fit", "--from", "materials.csv", "--chunk", "2"]
        start = {"slurm": slurm, "snakemake": snakemake, "dask": dask}[engine]

        start(source / "examples/engines", program, folder / "many", ensemble, folder)
        must([program, *ensemble, "--out", "alone"], cwd=folder)
        differ = same(folder / "many", folder / "alone")
        if differ or not (folder / "many/ensemble.html").is_file():
            sys.exit(f"the ensemble by {engine} has other bytes than by one process: {differ}")

        for seed in (1, 2):
            scene = (source / "tests/apps/scene.toml").read_text()
            (folder / f"scene-{seed}.toml").write_text(scene)
            must([program, "synth", folder / f"scene-{seed}.toml", "--out", folder / f"recordings/r{seed}"], cwd=folder)
        toml = folder / "recordings/r2/capture.toml"
        toml.write_text("# the same again\n" + toml.read_text())
        batch = ["batch", "recordings/*"] + [word for choice in SETTINGS for word in ("--set", choice)]
        start(source / "examples/engines", program, folder / "fits", batch, folder)
        table = (folder / "fits/results.csv").read_text()
        print(table)
        rows = table.strip().split("\n")
        if len(rows) != 3 or any("not run" in row for row in rows):
            sys.exit(f"not all recordings ended by {engine}")
    print(f"{engine}: the ensemble has the bytes of one process, and both recordings were fitted")


if __name__ == "__main__":
    main()
