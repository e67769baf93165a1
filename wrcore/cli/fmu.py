"""``wrcore fmu``: a scene as a functional mock-up unit."""

from wrcore.cli.common.files import output

ABOUT = """
Write a scene as a functional mock-up unit (FMI) for co-simulation, with all files that it names. The machine that runs
it needs a Python of its own with wrcore installed: the unit holds no Python. 'pip install pythonfmu pythonfmu3' brings
what writes units. Inputs are those of a session: forces of actuators, torques of motors and brakes, the controller's
speed, friction of each rail.
"""


def add(commands):
    command = commands.add_parser("fmu", help="write a scene as an FMU for co-simulation", description=ABOUT)
    command.add_argument("scene", metavar="SCENE.yaml", help="'wrcore init FOLDER' makes some to start from")
    command.add_argument(
        "--set", action="append", default=[], metavar="key.path=value", dest="overrides",
        help="another value of a key of the scene, in SI units; may be repeated",
    )  # fmt: skip
    command.add_argument("--out", required=True, metavar="x.fmu", help="write the unit here")
    command.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of FMI (default: 2)")
    command.add_argument(
        "--output", action="append", default=[], metavar="NAME", dest="outputs",
        help="a channel as output, such as wheelset.y_m or wheelset/left.Q_N; may be repeated (default: all channels "
        "of bodies and of the drive)",
    )  # fmt: skip
    command.set_defaults(run=run)


def run(options):
    from wrcore.run.fmu import library_of, write_fmu
    from wrcore.scene.description import load_scene

    out = output(options.out, (".fmu",))
    library_of(options.fmi)
    inputs, outputs = write_fmu(load_scene(options.scene, options.overrides), out, options.fmi, options.outputs)
    print(f"{out}: FMI {options.fmi}; inputs: {', '.join(inputs) or 'none'}; {len(outputs)} outputs")
    return 0
