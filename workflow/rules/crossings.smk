# A wheel over the nose of a crossing: what patch models and detections do there.

CROSSINGS = config["crossings"]
CORE["crossings"] = sources(*LOADED, *SCENE, "analysis/contact/on_slices", *STYLE, "study/crossings")


rule crossing_nose:
    message: "A wheel over the nose of a crossing"
    input:
        core=CORE["crossings"],
        scenes=SCENES,
        scene=CROSSINGS["scene"],
    output:
        table=shown("crossings/nose.csv", "a wheel over the nose"),
        summary=shown("crossings/models.csv", "patch models on the nose"),
        figure=shown("crossings/nose.png", "a wheel over the nose"),
        svg="<results>/crossings/nose.svg",
    log: "<logs>/crossing_nose.log"
    benchmark: "<benchmarks>/crossing_nose.tsv"
    params:
        models=CROSSINGS["models"],
        places=CROSSINGS["places"],
        load=CROSSINGS["load"],
        yaw=CROSSINGS["yaw"],
    script: "../scripts/crossings/nose.py"


rule crossings_study:
    input:
        rules.crossing_nose.output,
