"""The study's report: Snakemake's own, of everything but itself, with the configuration in use."""

import json
import subprocess
import sys
import tempfile

with tempfile.NamedTemporaryFile("w", suffix=".json") as file, open(snakemake.log[0], "w") as log:
    json.dump(snakemake.params.config, file)
    file.flush()
    command = [sys.executable, "-m", "snakemake", "--nolock", "--cores", "1", "--configfile", file.name]
    command += ["--report", snakemake.output[0], "study"]
    subprocess.run(command, check=True, stdout=log, stderr=log)
