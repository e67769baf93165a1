"""Pages of `reports/` that are run as they stand: files written, commands and lines of Python run, in their order."""

import re
import shlex

from tests.conftest import ROOT
from wrcore.cli import main


def blocks(page):
    """Kind and text of the blocks of a page of `reports/`."""
    return re.findall(r"```(\w+)\n(.*?)```", (ROOT / "reports" / page).read_text(encoding="utf-8"), re.DOTALL)


def run_blocks(page, left_out=()):
    """Run a page in the working directory; blocks of text are what it prints, those of some kinds are ``left_out``."""
    for kind, text in blocks(page):
        if kind in left_out:
            continue
        name = re.match(r"# file: (\S+)\n", text)
        if name:
            with open(name[1], "w") as file:
                file.write(text)
        elif kind == "python":
            exec(compile(text, page, "exec"), {})
        elif kind == "bash":
            for line in text.strip().splitlines():
                program, *arguments = shlex.split(line)
                assert program == "wrcore" and main(arguments) == 0, line
        else:
            assert kind == "text", kind
