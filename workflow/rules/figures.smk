# One rule per figure of the paper; the function in wrcore.analysis.style has the rule's name.


rule fig1_parametrisation:
    message:
        "Fig. 1: surfaces and coordinates"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["contact_geometry"]["scene"],
    output:
        report(
            "<results>/figures/fig1_parametrisation.png",
            caption="../report/fig1.rst",
            category="02 The paper's figures",
            labels={"figure": "1"},
        ),
        "<results>/figures/fig1_parametrisation.svg",
    log:
        "<logs>/fig1_parametrisation.log",
    script:
        "../scripts/fig1_parametrisation.py"


rule fig2_profiles:
    message:
        "Fig. 2: points on the profiles"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["contact_geometry"]["scene"],
    output:
        report(
            "<results>/figures/fig2_profiles.png",
            caption="../report/fig2.rst",
            category="02 The paper's figures",
            labels={"figure": "2"},
        ),
        "<results>/figures/fig2_profiles.svg",
    log:
        "<logs>/fig2_profiles.log",
    script:
        "../scripts/fig2_profiles.py"


rule fig3_detection:
    message:
        "Fig. 3: planar and spatial detection"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["contact_geometry"]["scene"],
    output:
        report(
            "<results>/figures/fig3_detection.png",
            caption="../report/fig3.rst",
            category="02 The paper's figures",
            labels={"figure": "3"},
        ),
        "<results>/figures/fig3_detection.svg",
    log:
        "<logs>/fig3_detection.log",
    params:
        pose=config["figures"]["detection_pose"],
    script:
        "../scripts/fig3_detection.py"


rule fig4_lateral_position:
    message:
        "Fig. 4: lateral position"
    input:
        core=CORE["figures"],
        planar=expand(rules.simulate.output.planar, case=CASES),
        spatial=expand(rules.simulate.output.spatial, case=CASES),
        tight=expand(rules.simulate_twins.output.tight, case=WITH_TWINS),
    output:
        report(
            "<results>/figures/fig4_lateral_position.png",
            caption="../report/fig4.rst",
            category="02 The paper's figures",
            labels={"figure": "4"},
        ),
        "<results>/figures/fig4_lateral_position.svg",
    log:
        "<logs>/fig4_lateral_position.log",
    params:
        titles={case: config["cases"][case]["title"] for case in CASES},
        bound=config["twins"]["bound"],
    script:
        "../scripts/fig4_lateral_position.py"


rule fig5_contact_points:
    message:
        "Fig. 5: contact points"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["cases"][config["figures"]["contact_points"]]["scene"],
        planar=expand(rules.simulate.output.planar, case=config["figures"]["contact_points"]),
        spatial=expand(rules.simulate.output.spatial, case=config["figures"]["contact_points"]),
        tight=expand(rules.simulate_twins.output.tight, case=set(WITH_TWINS) & {config["figures"]["contact_points"]}),
    output:
        report(
            "<results>/figures/fig5_contact_points.png",
            caption="../report/fig5.rst",
            category="02 The paper's figures",
            labels={"figure": "5"},
        ),
        "<results>/figures/fig5_contact_points.svg",
    log:
        "<logs>/fig5_contact_points.log",
    params:
        bound=config["twins"]["bound"],
    script:
        "../scripts/fig5_contact_points.py"
