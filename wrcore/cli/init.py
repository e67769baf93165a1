"""``wrcore init``: write example files as a starting point."""

ABOUT = """
Copy the example scenes, their vehicles, sweeps and wear plans into FOLDER, to be run and changed. Nothing that is there
is written over.
"""

NEXT = """{folder}: scenes, vehicles, sweeps, wear. To begin with:
  cd {folder}
  wrcore simulate scenes/suspended_wheelset.yaml --set speed=50 --out run.h5
  wrcore sweep sweeps/smoke.yaml --out table.csv"""


def add(commands):
    command = commands.add_parser("init", help="copy scenes, vehicles and a sweep to start from", description=ABOUT)
    command.add_argument("folder", metavar="FOLDER", help="created if needed")
    command.set_defaults(run=run)


def run(options):
    from wrcore.scene.examples import copy_examples

    print(NEXT.format(folder=copy_examples(options.folder)))
    return 0
