"""``wrcore profiles``: what can be named."""


def add(commands):
    command = commands.add_parser(
        "profiles", help="list the named wheel and rail profiles",
        description="List the named profiles: name, kind, sections from the flange or the crown, source.",
    )  # fmt: skip
    command.set_defaults(run=run)


def run(options):
    from wrcore.geometry.standards import list_profiles

    rows = list_profiles()
    rows.insert(0, {key: key for key in rows[0]})
    widths = [max(len(str(row[key])) for row in rows) for key in rows[0]]
    for row in rows:
        print("  ".join(str(cell).ljust(width) for cell, width in zip(row.values(), widths, strict=True)).rstrip())
    return 0
