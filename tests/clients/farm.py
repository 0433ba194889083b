"""Makes a shot on real farms, and compares it with the shot of one process: farm.py FRAZIL FOLDER [OPENJD].

OpenJD runs its tasks here; Slurm has one node on this machine, which needs root and Debian's slurmd, slurmctld, slurm-client and munge. Tasks
are doubled, killed and queued again. Prints the count of files that differ.
"""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

CUBE = """v -.1 -.1 -.1
v .1 -.1 -.1
v -.1 .1 -.1
v .1 .1 -.1
v -.1 -.1 .1
v .1 -.1 .1
v -.1 .1 .1
v .1 .1 .1
f 1 3 4 2
f 5 6 8 7
f 1 2 6 5
f 3 7 8 4
f 1 5 7 3
f 2 4 8 6
"""
SCENE = """[shot]
frames = "1-24"
[snow]
ground = 0.0
area = [-0.5, -0.5, 0.5, 1.5]
depth = 0.3
cell = 0.02
[grains]
[mist]
[output]
fog = ["base", "grains", "mist"]
mesh = ["usd"]
objects = ["usd"]
[[object]]
file = "cube.obj"
keys = [{ frame = 1, at = [0, 0.25, 0] }, { frame = 24, at = [0, 0.25, 0.9] }]
"""
# Frames of a chunk, and the longest time (s) for a shot.
CHUNK = "4"
PATIENCE = 900


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, capture_output=True, **options).stdout


def files(folder):
    """The files of a shot, without the times in reports and the folder's own account of its files, which has their times."""
    found = (path for path in folder.rglob("*") if path.is_file())
    names = (path.relative_to(folder) for path in found)
    return {name for name in names if name.parts[0] != "report" and name.name not in ("files.json", "run.lock")}


def differing(one, other):
    names = files(one) | files(other)
    equal = (name for name in names if all((folder / name).is_file() for folder in (one, other)))
    return sorted(names - {name for name in equal if (one / name).read_bytes() == (other / name).read_bytes()})


def openjd(frazil, openjd_program, folder):
    """Every step after the ones that it depends on, as OpenJD's own runner does; then all chunks once more."""
    job = folder / "job.json"
    job.write_text(run(frazil, "jobs", "shot.toml", "-o", "openjd", "--for", "openjd", "--chunk", CHUNK, "--program", frazil, cwd=folder))
    run(openjd_program, "check", job)
    for step in [step["name"] for step in json.loads(job.read_text())["steps"]]:
        times = 2 if step == "volumes" else 1
        for _ in range(times):
            run(openjd_program, "run", job, "--step", step)
    return folder / "openjd"


class Slurm:
    """A controller and a node on the loopback interface."""

    def __init__(self, folder):
        self.folder = folder
        host, cores = socket.gethostname().split(".")[0], os.cpu_count()
        for part in ("state", "spool"):
            (folder / part).mkdir(parents=True)
        ports = [free_port(), free_port()]
        settings = {
            "ClusterName": "frazil",
            "SlurmctldHost": f"{host}(127.0.0.1)",
            "SlurmUser": "root",
            "SlurmctldPort": ports[0],
            "SlurmdPort": ports[1],
            "StateSaveLocation": folder / "state",
            "SlurmdSpoolDir": folder / "spool",
            "SlurmctldPidFile": folder / "slurmctld.pid",
            "SlurmdPidFile": folder / "slurmd.pid",
            "SlurmctldLogFile": folder / "slurmctld.log",
            "SlurmdLogFile": folder / "slurmd.log",
            "CommunicationParameters": "NoCtldInAddrAny,NoInAddrAny",
            "ProctrackType": "proctrack/pgid",
            "TaskPlugin": "task/none",
            "JobAcctGatherType": "jobacct_gather/none",
            "AccountingStorageType": "accounting_storage/none",
            "SchedulerParameters": "batch_sched_delay=0,sched_interval=1",
            "SelectType": "select/cons_tres",
            "SelectTypeParameters": "CR_CPU",
            "MpiDefault": "none",
            "SwitchType": "switch/none",
        }
        lines = [f"{name}={value}" for name, value in settings.items()]
        lines += [f"NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN", f"PartitionName=main Nodes={host} Default=YES State=UP"]
        self.config = folder / "slurm.conf"
        self.config.write_text("\n".join(lines) + "\n")
        self.environment = {**os.environ, "SLURM_CONF": str(self.config)}

    def __enter__(self):
        self.munge = None
        if subprocess.run(["munge", "-n"], capture_output=True).returncode != 0:
            Path("/run/munge").mkdir(exist_ok=True)
            shutil.chown("/run/munge", "munge", "munge")
            self.munge = subprocess.Popen(["runuser", "-u", "munge", "--", "munged", "--foreground"])
            wait_until(lambda: subprocess.run(["munge", "-n"], capture_output=True).returncode == 0, "munge does not answer")
        self.daemons = [subprocess.Popen([daemon, "-D", "-f", str(self.config)], env=self.environment) for daemon in ("slurmctld", "slurmd")]
        wait_until(lambda: "idle" in self.answer("sinfo", "-h", "-o", "%t"), "Slurm's node is not idle")
        return self

    def __exit__(self, *_):
        for daemon in [*reversed(self.daemons), *filter(None, [self.munge])]:
            daemon.send_signal(signal.SIGTERM)
            daemon.wait()

    def answer(self, *command):
        return subprocess.run(command, env=self.environment, text=True, capture_output=True).stdout

    def jobs(self):
        """States by name and number of those that have not ended well."""
        lines = self.answer("squeue", "-h", "-r", "-t", "all", "-o", "%j|%i|%T").split()
        return [line.split("|") for line in lines if not line.endswith("COMPLETED")]


def slurm(frazil, folder):
    script = folder / "submit.sh"
    script.write_text(run(frazil, "jobs", "shot.toml", "-o", "slurm", "--for", "slurm", "--chunk", CHUNK, "--program", frazil, cwd=folder))
    with Slurm(folder / "slurmd") as farm:
        run("sh", script, cwd=folder, env=farm.environment)
        # One task of a stage that remembers and one chunk are killed in their work, and go on.
        for stage in ("grains", "volumes"):
            running = lambda: [number for name, number, state in farm.jobs() if name.endswith(stage) and state == "RUNNING"]
            wait_until(running, f"no task of {stage} runs", PATIENCE)
            time.sleep(0.5)
            for number in running()[:1]:
                farm.answer("scontrol", "requeue", number)
                print(f"frazil: killed and queued again: {stage}, job {number}", flush=True)
        wait_until(lambda: not farm.jobs(), "jobs have not ended well", PATIENCE)
        # A farm that loses track of what it did does it again.
        chunks = run(frazil, "jobs", "shot.toml", "-o", "slurm", "--chunk", CHUNK, "--program", frazil, cwd=folder).splitlines()
        for number, line in enumerate(line for line in chunks if line.startswith("volumes")):
            farm.answer("sbatch", "--parsable", f"--job-name=again-{number}", f"--wrap={line.split(' ', 2)[2]}")
        wait_until(lambda: not farm.jobs(), "doubled jobs have not ended well", PATIENCE)
    return folder / "slurm"


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def wait_until(is_true, otherwise, seconds=60):
    end = time.monotonic() + seconds
    while not is_true():
        if time.monotonic() > end:
            sys.exit(f"farm.py: {otherwise} after {seconds} s")
        time.sleep(0.2)


def main():
    frazil, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    openjd_program = shutil.which(sys.argv[3] if len(sys.argv) > 3 else "openjd")
    missing = [name for name in ("sbatch", "slurmctld", "slurmd", "munge") if not shutil.which(name)]
    if missing or not openjd_program:
        sys.exit(f"farm.py: not installed: {', '.join(missing + ([] if openjd_program else ['openjd']))}")
    folder.mkdir(parents=True)
    (folder / "cube.obj").write_text(CUBE)
    (folder / "shot.toml").write_text(SCENE)
    run(frazil, "snow", "shot.toml", "-o", "one", "-q", cwd=folder)
    count = 0
    for made in (openjd(frazil, openjd_program, folder), slurm(frazil, folder)):
        found = differing(folder / "one", made)
        for name in found:
            print(f"differs on {made.name}: {name}")
        print(f"frazil: {made.name}: {len(files(made))} files, {len(found)} differ", flush=True)
        count += len(found)
    print(f"farm.equal {count}")
    return count > 0


sys.exit(main())
