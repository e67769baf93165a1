# Contact geometry: pairs of profiles, planar against spatial detection, reductions against CONTACT, the search's bar.
# CONTACT's cases are read where the tests keep them: one copy, whose provenance stands in its first lines.

CONTACT = config["contact"]
CONTACT_PAIR = list(CONTACT["pairs"].values())[0]
CONTACT_PAIR_FIGURES = ["location", "radius_difference", "angle", "conicity", "location_with_yaw"]


rule contact_pairs:
    message: "Contact geometry of the pairs"
    input:
        core=CORE["contact_figures"],
    output:
        touch="<results>/contact/touch.csv",
        conicity="<results>/contact/conicity.csv",
        yaw="<results>/contact/location_with_yaw.csv",
        location=shown("contact/contact_location.png", "contact points"),
        radius=shown("contact/contact_radius_difference.png", "rolling radius difference"),
        angle=shown("contact/contact_angle.png", "contact angle"),
        conicity_figure=shown("contact/contact_conicity.png", "equivalent conicity"),
        yaw_figure=shown("contact/contact_location_with_yaw.png", "contact points with yaw"),
        svg=expand("<results>/contact/contact_{name}.svg", name=CONTACT_PAIR_FIGURES),
    log: "<logs>/contact_pairs.log"
    params:
        pairs=CONTACT["pairs"],
        shifts=CONTACT["shifts"],
        yaws=CONTACT["yaws"],
        amplitudes=CONTACT["amplitudes"],
    script: "../scripts/contact/contact_pairs.py"


rule contact_planar_error:
    message: "Error of planar detection over yaw and contact angle"
    input:
        core=CORE["contact_figures"],
    output:
        table="<results>/contact/planar_error.csv",
        figure=shown("contact/contact_planar_error.png", "planar against spatial"),
        svg="<results>/contact/contact_planar_error.svg",
    log: "<logs>/contact_planar_error.log"
    params:
        pair=CONTACT_PAIR,
        settings=CONTACT["planar_error"],
    script: "../scripts/contact/contact_planar_error.py"


rule contact_reductions:
    message: "Reductions: continuity, coexisting patches, agreement with CONTACT"
    input:
        core=CORE["contact_figures"],
        reference=CONTACT["reductions"]["reference"],
    output:
        cases="<results>/contact/reductions_cases.csv",
        summary=shown("contact/reductions.csv", "reductions against CONTACT"),
        jumps="<results>/contact/force_steps.csv",
        patches="<results>/contact/patch_forces.csv",
        sweep_figure=shown("contact/contact_force_sweep.png", "force in a lateral sweep"),
        patch_figure=shown("contact/contact_patch_forces.png", "two patches"),
        svg=expand("<results>/contact/contact_{name}.svg", name=["force_sweep", "patch_forces"]),
    log: "<logs>/contact_reductions.log"
    params:
        pair=CONTACT_PAIR,
        settings=CONTACT["reductions"],
    script: "../scripts/contact/contact_reductions.py"


rule contact_study:
    input:
        rules.contact_pairs.output,
        rules.contact_planar_error.output,
        rules.contact_reductions.output,
