"""A SLURM of one node on this machine for as long as a test takes; nothing outside a temporary folder is touched."""

import importlib.util
import os
import shutil
import socket
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

CONFIGURATION = """
ClusterName=lone
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={daemon}
AuthType=auth/none
CredType=cred/none
PluginDir={plugins}
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
SwitchType=switch/none
JobCompType=jobcomp/none
ReturnToService=2
MinJobAge=300
NodeName=localhost NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory} State=UNKNOWN
PartitionName=main Nodes=localhost Default=YES MaxTime=INFINITE State=UP
"""


def _program(name):
    """A program of SLURM, under its own name or as Debian calls it."""
    places = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
    return shutil.which(name, path=places) or shutil.which(f"{name}-wlm", path=places)


def _plugins():
    """Folder of SLURM's plugins if it holds those for a node without authentication."""
    root = Path(_program("sbatch")).resolve().parents[1]
    return next((path.parent for path in sorted(root.glob("lib*/**/slurm*/auth_none.so"))), None)


def missing():
    """Why no SLURM can be started here, or an empty string."""
    absent = [name for name in ("sbatch", "slurmctld", "slurmd", "slurmstepd") if _program(name) is None]
    if absent:
        return f"SLURM is not installed: no {', '.join(absent)}"
    if os.geteuid() != 0:
        return "a SLURM node of one's own needs root"
    if _plugins() is None:
        return "this SLURM was built without auth/none"
    if importlib.util.find_spec("snakemake_executor_plugin_slurm") is None:
        return 'Snakemake\'s SLURM plugin is not installed: pip install -e ".[cluster]"'
    return ""


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def slurm_node(folder):
    """Start controller and daemon; yields the environment in which ``sbatch`` finds them.

    Parameters
    ----------
    folder : pathlib.Path
        For state, spool and logs.
    """
    for name in ("state", "spool"):
        (folder / name).mkdir()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 * 3 // 4
    text = CONFIGURATION.format(
        folder=folder,
        controller=_free_port(),
        daemon=_free_port(),
        plugins=_plugins(),
        cpus=os.cpu_count(),
        memory=memory,
    )
    (folder / "slurm.conf").write_text(text)
    # Snakemake takes SLURM's variables out of a job's environment: on a cluster the configuration lies in /etc/slurm
    (folder / "bin").mkdir()
    (folder / "bin" / "srun").write_text(f'#!/bin/sh\nSLURM_CONF={folder}/slurm.conf exec {_program("srun")} "$@"\n')
    (folder / "bin" / "srun").chmod(0o755)
    clean = {name: value for name, value in os.environ.items() if not name.startswith("SLURM_")}
    path = os.pathsep.join([str(folder / "bin"), os.environ["PATH"]])
    environment = clean | {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
    commands = (
        [_program("slurmctld"), "-D"],
        [_program("slurmd"), "-D", "-N", "localhost", "-d", _program("slurmstepd")],
    )
    started = []
    try:
        for command in commands:
            with open(folder / f"{Path(command[0]).name}.out", "w") as out:
                started.append(subprocess.Popen(command, env=environment, stdout=out, stderr=out))
        _wait_until_idle(environment, started, folder)
        yield environment
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(30)


def _wait_until_idle(environment, started, folder, seconds=60):
    for _ in range(2 * seconds):
        if any(process.poll() is not None for process in started):
            break
        state = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True)
        if state.stdout.strip() == "idle":
            return
        time.sleep(0.5)
    logs = "\n".join(path.read_text()[-2000:] for path in [*folder.glob("*.log"), *folder.glob("*.out")])
    raise RuntimeError(f"SLURM did not come up:\n{logs}")
