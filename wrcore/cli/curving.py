"""``wrcore curving``: equilibrium of a scene's vehicle in constant curves."""

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import as_runs, columns

ABOUT = """
Balance of a scene's vehicle in constant curves, without a run over time: wheel forces, angle of attack and lateral
place over curvature. reports/response.md says how.
"""

FILES = columns(
    "OUT.csv, a row per curve and wheel; empty where no balance was found",
    radius_m="of the curve, positive to the left",
    speed_m_per_s="in it",
    cant_m="outer rail above the inner one, over 1.5 m",
    cant_deficiency_m="1.5 m v^2/(g R) less the cant",
    wheelset="name",
    side="left or right",
    y_m="of the wheelset",
    yaw_rad="of the wheelset: its angle of attack",
    **as_runs("Q_N", "Y_N", "Y_over_Q", "T_gamma_N", "sum_Y_N"),
    acceleration_m_per_s2="with which creep slows down a vehicle that nothing pulls",
    residual_m_per_s2="largest acceleration left",
)


def add(commands):
    command = commands.add_parser("curving", help="balance in constant curves", description=ABOUT, epilog=FILES)
    command.add_argument("scene", metavar="SCENE.yaml", help="scene file")
    command.add_argument("--radius", required=True, nargs="+", type=float, metavar="m", help="positive to the left, m")
    command.add_argument("--cant", type=float, default=0.0, metavar="m", help="over 1.5 m, m")
    command.add_argument("--speed", type=float, metavar="m/s", help="m/s (default: the scene's)")
    command.add_argument("--cant-deficiency", type=float, metavar="m", help="instead of a speed, m")
    command.add_argument("--widening", type=float, default=0.0, metavar="m", help="of the gauge, m")
    command.add_argument("--set", action="append", default=[], metavar="key.path=value", help="change the scene")
    command.add_argument("--out", required=True, metavar="OUT.csv", help="the table")
    command.set_defaults(run=run)


def run(options):
    out = output(options.out)
    from wrcore.analysis.response.curving import quasi_static_curving
    from wrcore.scene.description import load_scene

    scene, limits = load_scene(options.scene, options.set), (options.speed, options.cant_deficiency)
    write_csv(quasi_static_curving(scene, options.radius, options.cant, *limits, options.widening), out)
    return 0
