"""A Slurm of this machine alone, for tests: munged, slurmctld and slurmd of their own, with ports,
keys and state in a folder that goes with them."""
import ctypes
import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")
CLIENTS = ("sbatch", "scancel", "scontrol", "squeue")
SECONDS = 60  # that a daemon may take to answer


PR_SET_PDEATHSIG = 1


class NotHere(Exception):
    """Slurm is not installed or cannot be started here; says why."""


def find(program):
    path = shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
    if path is None:
        raise NotHere(f"no {program} (packages slurmctld, slurmd, slurm-client, munge)")
    return path


def free_ports(count):
    """Two daemons must not be given one port, so all are held until all are known."""
    held = [socket.socket() for _ in range(count)]
    for s in held:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in held]
    for s in held:
        s.close()
    return ports


def die_with_parent():
    """Also where the test itself is killed no daemon stays."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Slurm:
    """`with Slurm(folder, cpus) as slurm`: runs until the end of the block, whatever happens there.
    Commands need `slurm.environment`."""

    def __init__(self, folder, cpus):
        self.folder = Path(folder)
        self.cpus = cpus
        self.processes = []
        self.environment = dict(os.environ, SLURM_CONF=str(self.folder / "slurm.conf"))

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def start(self):
        daemon = {name: find(name) for name in DAEMONS}
        for client in CLIENTS:
            find(client)
        self.folder.mkdir(mode=0o755)
        self.write_configuration()

        # The key to all others' trust, then the controller, then the node.
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        munge = [f"--{part}={self.folder}/munge.{end}" for part, end in
                 (("socket", "socket"), ("key-file", "key"), ("pid-file", "pid"),
                  ("log-file", "log"), ("seed-file", "seed"))]
        self.spawn("munged", [daemon["munged"], "--foreground", "--force", "--num-threads=2", *munge])
        self.wait("munged", lambda: (self.folder / "munge.socket").exists())
        self.spawn("slurmctld", [daemon["slurmctld"], "-D", "-c"])
        self.wait("slurmctld", lambda: self.ask("scontrol", "ping").find("UP") >= 0)
        self.spawn("slurmd", [daemon["slurmd"], "-D", "-N", "here"])
        self.wait("slurmd", lambda: "State=IDLE" in self.ask("scontrol", "show", "node", "here")
                  .split("+")[0])

    def write_configuration(self):
        user, host = pwd.getpwuid(os.geteuid()).pw_name, socket.gethostname()
        controller, node = free_ports(2)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "slurm.conf").write_text(f"""\
ClusterName=here
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge.socket
CredType=cred/munge
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/slurmctld.log
SlurmdLogFile={self.folder}/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
SchedulerType=sched/builtin
SchedulerParameters=batch_sched_delay=0,sched_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=2
NodeName=here NodeHostname={host} NodeAddr=127.0.0.1 CPUs={self.cpus} RealMemory=100000
PartitionName=all Nodes=here Default=YES MaxTime=INFINITE State=UP
""")
        (self.folder / "cgroup.conf").write_text("CgroupAutomount=no\n")

    def spawn(self, name, command):
        with open(self.folder / f"{name}.out", "w") as out:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                                       env=self.environment, start_new_session=True,
                                       preexec_fn=die_with_parent)
        self.processes.append((name, process))

    def ask(self, *command):
        return subprocess.run(command, capture_output=True, text=True, env=self.environment).stdout

    def wait(self, name, ready):
        """Until the daemon that was started last answers. A check of its own does not see others."""
        end = time.monotonic() + SECONDS
        while not ready():
            dead = self.processes[-1][1].poll() is not None
            if dead or time.monotonic() > end:
                told = [(self.folder / f"{name}.{end}") for end in ("out", "log")]
                tail = " | ".join(line for file in told if file.exists()
                                  for line in file.read_text(errors="replace").splitlines()[-3:])
                raise NotHere(f"{name} {'ended' if dead else 'does not answer'}: {tail}")
            time.sleep(0.1)

    def stop(self):
        """What Slurm started goes first, then the daemons, the node before its controller."""
        if len(self.processes) == len(DAEMONS):
            self.ask("scancel", f"--user={os.geteuid()}")
            end = time.monotonic() + 10
            while self.ask("squeue", "--noheader") and time.monotonic() < end:
                time.sleep(0.2)
        for _, process in reversed(self.processes):
            if process.poll() is not None:
                continue
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.processes = []
