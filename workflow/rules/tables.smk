# What runs read (creep table) and what they can be checked against (contact geometry).


rule creep_table:
    message:
        "Creep table by exact rolling contact"
    input:
        core=CORE["creep"],
    output:
        "<results>/tables/creep.h5",
    log:
        "<logs>/creep_table.log",
    benchmark:
        "<benchmarks>/creep_table.tsv"
    params:
        settings=config["creep_table"],
    script:
        "../scripts/creep_table.py"


rule contact_geometry:
    message:
        "Contact geometry without load"
    input:
        core=CORE["geometry"],
        scenes=SCENES,
        scene=config["contact_geometry"]["scene"],
    output:
        "<results>/tables/contact_geometry.csv",
    log:
        "<logs>/contact_geometry.log",
    params:
        y=config["contact_geometry"]["y"],
    script:
        "../scripts/contact_geometry.py"
