# The paper: its runs, its figures, its timing table, and its values beside ours. Each rule's function has its name.


rule contact_geometry:
    message: "Contact geometry without load"
    input:
        core=CORE["geometry"],
        scenes=SCENES,
        scene=config["paper"]["geometry"]["scene"],
    output:
        "<results>/paper/contact_geometry.csv",
    log: "<logs>/contact_geometry.log"
    params:
        y=config["paper"]["geometry"]["y"],
    script: "../scripts/paper/contact_geometry.py"


rule simulate:
    message: "{wildcards.case}: planar and spatial run"
    input:
        core=CORE["simulation"],
        scenes=SCENES,
        scene=case_scene,
        table=rules.creep_table.output,
    output:
        planar="<results>/paper/runs/{case}/planar.h5",
        spatial="<results>/paper/runs/{case}/spatial.h5",
    log: "<logs>/simulate/{case}.log"
    benchmark: "<benchmarks>/simulate/{case}.tsv"
    params:
        overrides=case_overrides,
    script: "../scripts/paper/simulate.py"


rule simulate_twins:
    message: "{wildcards.case}: tighter and mirrored twin of the spatial run"
    input:
        core=CORE["simulation"],
        scenes=SCENES,
        scene=case_scene,
        table=rules.creep_table.output,
    output:
        tight="<results>/paper/runs/{case}/spatial_tight.h5",
        mirrored="<results>/paper/runs/{case}/spatial_mirrored.h5",
    log: "<logs>/simulate_twins/{case}.log"
    benchmark: "<benchmarks>/simulate_twins/{case}.tsv"
    params:
        overrides=case_overrides,
        twins=config["paper"]["twins"],
    script: "../scripts/paper/simulate_twins.py"


rule time_runs:
    message: "Timing: planar and spatial runs in turn, nothing beside them"
    input:
        core=CORE["simulation"] + CORE["paper"],
        scenes=SCENES,
        table=rules.creep_table.output,
    output:
        "<results>/paper/timing_samples.csv",
    log: "<logs>/time_runs.log"
    benchmark: "<benchmarks>/time_runs.tsv"
    params:
        cases={case: [config["paper"]["cases"][case]["scene"], overrides(case)] for case in config["paper"]["timing"]["cases"]},
        repetitions=config["paper"]["timing"]["repetitions"],
        shift=config["paper"]["timing"]["shift"],
        first=config["paper"]["timing"]["first"],
    # all cores: nothing else may run beside it
    threads: workflow.cores
    script: "../scripts/paper/time_runs.py"


rule fig1_parametrisation:
    message: "Fig. 1: surfaces and coordinates"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["paper"]["geometry"]["scene"],
    output:
        shown("paper/fig1_parametrisation.png", "1"),
        "<results>/paper/fig1_parametrisation.svg",
    log: "<logs>/fig1_parametrisation.log"
    script: "../scripts/paper/surfaces.py"


use rule fig1_parametrisation as fig2_profiles with:
    message: "Fig. 2: points on the profiles"
    output:
        shown("paper/fig2_profiles.png", "2"),
        "<results>/paper/fig2_profiles.svg",
    log: "<logs>/fig2_profiles.log"


use rule fig1_parametrisation as fig3_detection with:
    message: "Fig. 3: planar and spatial detection"
    output:
        shown("paper/fig3_detection.png", "3"),
        "<results>/paper/fig3_detection.svg",
    log: "<logs>/fig3_detection.log"
    params:
        pose=config["paper"]["figures"]["detection_pose"],


rule fig4_lateral_position:
    message: "Fig. 4: lateral position"
    input:
        core=CORE["figures"],
        planar=expand(rules.simulate.output.planar, case=CASES),
        spatial=expand(rules.simulate.output.spatial, case=CASES),
        tight=expand(rules.simulate_twins.output.tight, case=WITH_TWINS),
    output:
        shown("paper/fig4_lateral_position.png", "4"),
        "<results>/paper/fig4_lateral_position.svg",
    log: "<logs>/fig4_lateral_position.log"
    params:
        titles={case: config["paper"]["cases"][case]["title"] for case in CASES},
        bound=config["paper"]["twins"]["bound"],
    script: "../scripts/paper/fig4_lateral_position.py"


rule fig5_contact_points:
    message: "Fig. 5: contact points"
    input:
        core=CORE["figures"],
        scenes=SCENES,
        scene=config["paper"]["cases"][config["paper"]["figures"]["contact_points"]]["scene"],
        planar=expand(rules.simulate.output.planar, case=config["paper"]["figures"]["contact_points"]),
        spatial=expand(rules.simulate.output.spatial, case=config["paper"]["figures"]["contact_points"]),
        tight=expand(rules.simulate_twins.output.tight, case=set(WITH_TWINS) & {config["paper"]["figures"]["contact_points"]}),
    output:
        shown("paper/fig5_contact_points.png", "5"),
        "<results>/paper/fig5_contact_points.svg",
    log: "<logs>/fig5_contact_points.log"
    params:
        bound=config["paper"]["twins"]["bound"],
    script: "../scripts/paper/fig5_contact_points.py"


rule motion_table:
    message: "Table: motion"
    input:
        core=CORE["paper"],
        planar=expand(rules.simulate.output.planar, case=CASES),
        spatial=expand(rules.simulate.output.spatial, case=CASES),
        tight=expand(rules.simulate_twins.output.tight, case=WITH_TWINS),
        mirrored=expand(rules.simulate_twins.output.mirrored, case=WITH_TWINS),
    output:
        shown("paper/motion.csv", "motion"),
    log: "<logs>/motion_table.log"
    params:
        bound=config["paper"]["twins"]["bound"],
    script: "../scripts/paper/motion_table.py"


rule timing_table:
    message: "Table: timing"
    input:
        core=CORE["paper"],
        samples=rules.time_runs.output,
    output:
        shown("paper/timing.csv", "timing", page="cost"),
    log: "<logs>/timing_table.log"
    script: "../scripts/paper/timing_table.py"


rule comparison_table:
    message: "Table: published values beside ours"
    input:
        core=CORE["paper"],
        reference="reports/reference_values.csv",
        geometry=rules.contact_geometry.output,
        motion=rules.motion_table.output,
        timing=rules.timing_table.output,
    output:
        shown("paper/comparison.csv", "comparison", page="comparison"),
        "<results>/paper/comparison.md",
    log: "<logs>/comparison_table.log"
    params:
        case=config["paper"]["comparison"]["case"],
    script: "../scripts/paper/comparison_table.py"
