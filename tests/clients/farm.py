"""Makes a shot with real farms, and compares it byte for byte with the shot of one process: python3 farm.py FRAZIL FOLDER

The farms are `openjd run`, twice at the same time, and a Slurm of two nodes that is started on loopback. In Slurm a stage is requeued while it
is running and then finds the folder in use, a chunk is killed, another one runs twice, and pictures follow their chunks by aftercorr.
"""

import contextlib
import fcntl
import getpass
import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

FRAMES, CHUNK = 24, 6
KILLED, DOUBLED = "7-12", "13-18"
SCENE = f"""[shot]
frames = "1-{FRAMES}"
[snow]
ground = 0.0
area = [-0.5, -0.5, 0.5, 1.5]
depth = 0.3
cell = 0.0125
[grains]
[output]
fog = ["base", "grains"]
mesh = ["usd"]
objects = ["usd"]
[[object]]
file = "box.obj"
keys = [{{ frame = 1, at = [0, 0.5, 0] }}, {{ frame = 8, at = [0, 0.25, 0] }}, {{ frame = {FRAMES}, at = [0, 0.25, 0.9] }}]
"""
CORNERS = [(x, y, z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.2)]
FACES = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
# Where make test-farm installs openjd, and where Debian has daemons, which is not on everybody's PATH.
PATH = os.pathsep.join([str(REPOSITORY / "target/clients/bin"), os.environ.get("PATH", ""), "/usr/sbin"])


def end(sentence):
    sys.exit(f"farm: {sentence}")


def program(name):
    return shutil.which(name, path=PATH) or end(f"{name} is not installed: make test-farm installs it.")


def run(*words, **more):
    """What a command prints; the end if it fails."""
    words = [str(word) for word in words]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if done.returncode:
        end(f"{shlex.join(words)} ended with {done.returncode}: {done.stdout[-3000:]}")
    return done.stdout


def wait(what, happened, seconds=300):
    """Waits until something is true, and returns it."""
    until = time.monotonic() + seconds
    while not (value := happened()):
        if time.monotonic() > until:
            end(f"{what} did not happen in {seconds} s.")
        time.sleep(0.005)
    return value


def processes(*words):
    """The processes with these words in their commands. A shell's has the whole command of its job in one word."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if {str(word) for word in words} <= set(path.read_bytes().decode(errors="replace").split("\0")):
                found.append(int(path.parent.name))
    return found


def different(one, other):
    """Names of files that are not in both folders, or differ. Reports have times in them, and files.json when files were written."""

    def files(folder):
        paths = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
        return {name: path for name, path in paths.items() if not name.startswith("report/") and not name.endswith(".lock")}

    a, b = files(one), files(other)
    common = [name for name in a.keys() & b.keys() if not name.endswith("files.json")]
    return sorted((a.keys() ^ b.keys()) | {name for name in common if a[name].read_bytes() != b[name].read_bytes()})


def make_scene(folder):
    lines = ["v {} {} {}".format(*corner) for corner in CORNERS] + [f"f {face}" for face in FACES]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    (folder / "shot.toml").write_text(SCENE)


def jobs(frazil, folder, farm, name):
    return run(frazil, "jobs", folder / "shot.toml", "-o", folder / name, "--for", farm, "--chunk", CHUNK, "--program", frazil)


def pictures(frazil, folder, name, frames):
    """The words of the command that makes pictures of the box. By itself the camera sees all of the frames that are given, so it is placed."""
    box, picture = folder / name / "objects/objects.%04d.usdc", folder / name / "picture.%04d.png"
    words = [frazil, "preview", box, "--frames", frames, "-o", picture, "--size", "160x90", "--eye=-2,1.5,2.5", "--target=0,0.3,0.4", "-q"]
    return [str(word) for word in words]


def by_openjd(frazil, folder):
    openjd = program("openjd")
    template = folder / "openjd.json"
    template.write_text(jobs(frazil, folder, "openjd", "openjd"))
    run(openjd, "check", template)
    # Two farms at once: all tasks twice.
    logs = [folder / f"openjd.{number}.log" for number in (1, 2)]
    both = [subprocess.Popen([openjd, "run", template], stdout=log.open("w"), stderr=subprocess.STDOUT) for log in logs]
    try:
        for process, log in zip(both, logs):
            if process.wait():
                end(f"openjd run ended with {process.returncode}: {log.read_text()[-3000:]}")
    finally:
        # openjd does not end by SIGTERM, nor does what it has started end with it.
        for process in both:
            process.kill()
        for process in processes(folder / "openjd"):
            os.kill(process, signal.SIGTERM)


CONFIGURATION = """ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
SwitchType=switch/none
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=4
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=4
PartitionName=main Nodes=n1,n2 Default=YES State=UP
"""


@contextlib.contextmanager
def slurm():
    """A Slurm of two nodes, with a munged of its own, for this user. Nothing is left of it afterwards."""
    daemons = [program(name) for name in ("munged", "slurmctld", "slurmd")]
    for name in ("sbatch", "squeue", "sinfo", "scontrol", "scancel"):
        program(name)
    # In /tmp, since the name of a socket must be short.
    folder = pathlib.Path(tempfile.mkdtemp(prefix="frazil-slurm-"))
    folder.chmod(0o755)
    for name in ("state", "n1", "n2"):
        (folder / name).mkdir()
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o400)
    with socket.create_server(("127.0.0.1", 0)) as a, socket.create_server(("127.0.0.1", 0)) as b, socket.create_server(("127.0.0.1", 0)) as c:
        ports = [one.getsockname()[1] for one in (a, b, c)]
    host = socket.gethostname().split(".")[0]
    (folder / "slurm.conf").write_text(CONFIGURATION.format(host=host, ports=ports, user=getpass.getuser(), folder=folder))
    os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
    munge = [f"--{name}-file={folder}/munge.{name}" for name in ("key", "pid", "log", "seed")] + [f"--socket={folder}/munge.socket"]
    started = []

    def start(name, *words):
        # In sessions of their own: Ctrl-C must not end them before their jobs.
        more = {"stdout": (folder / f"{name}.log").open("w"), "stderr": subprocess.STDOUT, "start_new_session": True}
        started.append(subprocess.Popen(words, **more))

    try:
        start("munged", daemons[0], "-F", "-f", *munge)
        wait("munged", (folder / "munge.socket").exists, 20)
        start("slurmctld", daemons[1], "-D")
        for node in ("n1", "n2"):
            start(node, daemons[2], "-D", "-N", node)
        idle = ["sinfo", "-h", "-N", "-t", "idle", "-o", "%N"]
        wait("two idle nodes", lambda: len(subprocess.run(idle, capture_output=True, text=True).stdout.split()) == 2, 60)
        try:
            yield
        finally:
            run("scancel", "--full", f"--user={getpass.getuser()}")
            wait("the end of all jobs", lambda: not run("squeue", "-h"), 60)
    except BaseException:
        for log in folder.glob("*.log"):
            print(f"{log.name}: {log.read_text()[-2000:]}", file=sys.stderr)
        raise
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(60)
        shutil.rmtree(folder, ignore_errors=True)


def known_jobs():
    """What Slurm knows of each job and each task of an array: the name, its index if it has one, state and number of restarts."""
    found = {}
    for line in run("scontrol", "show", "jobs", "-o").splitlines():
        fields = dict(re.findall(r"(\w+)=(\S*)", line))
        found[fields["JobName"], fields.get("ArrayTaskId")] = fields
    return found


def restarts(name, task=None):
    return int(known_jobs()[name, task]["Restarts"])


def hurry():
    """Starts jobs now that are queued again, which Slurm does after two minutes."""
    for line in run("squeue", "-h", "-r", "-t", "PENDING", "-o", "%i %r").splitlines():
        if line.endswith("BeginTime"):
            subprocess.run(["scontrol", "update", f"JobId={line.split()[0]}", "StartTime=now"], capture_output=True)


def by_slurm(frazil, folder):
    output, logs = folder / "slurm", folder / "logs"
    logs.mkdir()
    script = jobs(frazil, folder, "slurm", "slurm")
    # Busy is busy soon.
    (folder / "slurm.sh").write_text(script.replace("--wait 600", "--wait 1"))
    with slurm():
        options = [f"--output={logs}/%x.%j.log", "--open-mode=append"]
        finish = run("sh", folder / "slurm.sh", *options).strip()
        number = {name: fields.get("ArrayJobId", fields["JobId"]) for (name, _), fields in known_jobs().items()}
        assert number["shot-finish"] == finish, number
        chunk = [frazil, "snow", folder / "shot.toml", "-o", output, "--chunk", "--stage", "volumes", "--frames", DOUBLED, "--wait", "9"]
        wrap = shlex.join(str(word) for word in chunk)
        run("sbatch", *options, "--job-name=doubled", f"--dependency=afterok:{number['shot-grains']}", f"--wrap={wrap}")
        frames = f"$((SLURM_ARRAY_TASK_ID * {CHUNK} + 1))-$((SLURM_ARRAY_TASK_ID * {CHUNK} + {CHUNK}))"
        wrap = shlex.join(pictures(frazil, folder, "slurm", "FRAMES")).replace("FRAMES", frames)
        after = f"--dependency=aftercorr:{number['shot-objects']}"
        run("sbatch", *options, "--job-name=pictures", f"--array=0-{FRAMES // CHUNK - 1}", after, f"--wrap={wrap}")

        # A stage is queued again while it is at work, and does not get the folder when it comes back.
        wait("a frame of the base", lambda: (output / "state/base.0003.json").exists())
        run("scontrol", "requeue", number["shot-base"])
        wait("the end of the base", lambda: not processes(output, "base"))
        assert not (output / f"state/base.{FRAMES:04d}.json").exists(), "the base was done before it was stopped"
        with (output / "state/run.lock").open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            wait("busy", lambda: (hurry(), time.sleep(0.2), restarts("shot-base") >= 2)[-1])

        # A chunk is killed.
        first, last = (int(frame) for frame in KILLED.split("-"))

        def chunk_at_work():
            hurry()
            return (output / f"fog/fog.{first:04d}.vdb").exists() and processes(output, "volumes", KILLED)

        for process in wait("a frame of the chunk", chunk_at_work):
            os.kill(process, signal.SIGKILL)
        assert not (output / f"fog/fog.{last:04d}.vdb").exists(), "the chunk was done before it was killed"
        wait("the end of all jobs", lambda: (hurry(), time.sleep(0.2), not run("squeue", "-h"))[-1])
        for (name, task), fields in known_jobs().items():
            if fields["JobState"] != "COMPLETED":
                end(f"{name} {task or ''} ended as {fields['JobState']}: see {logs}.")
        assert restarts("shot-volumes", str((first - 1) // CHUNK)) == 1, "the chunk was not queued again"


def main():
    # Ends by an exception, so that nothing is left at work.
    signal.signal(signal.SIGTERM, lambda *_: end("terminated."))
    frazil, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    make_scene(folder)
    run(frazil, "snow", folder / "shot.toml", "-o", folder / "one", "-q")
    by_openjd(frazil, folder)
    differing = [f"openjd/{name}" for name in different(folder / "one", folder / "openjd")]
    by_slurm(frazil, folder)
    run(*pictures(frazil, folder, "one", f"1-{FRAMES}"))
    differing += [f"slurm/{name}" for name in different(folder / "one", folder / "slurm")]
    print(*[f"farm: {name} differs" for name in differing], f"farm.equal {len(differing)}", sep="\n")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
