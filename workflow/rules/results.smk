# The study as a whole: one table, one report, and a last rule that fails if any run failed.


rule collect:
    input:
        study=f"{FOLDER}/study.yaml",
        table=f"{FOLDER}/runs.tsv",
        batches=expand(rules.batch.output.done, batch=COLLECTED),
        outcomes=expand(rules.simulate.output.outcome, run=ALONE),
        measures=expand(rules.measure.output.measures, run=ALONE),
    output:
        summary=report(
            f"{FOLDER}/summary.tsv",
            caption="../report/summary.rst",
            category="Study",
            labels={"table": "runs, outcomes and cost"},
        ),
        curves=report(
            f"{FOLDER}/curves.tsv",
            caption="../report/curves.rst",
            category="Study",
            labels={"table": "measures against time"},
        ),
        agreement=f"{FOLDER}/agreement.tsv",
        checks=CHECKS,
    log:
        f"{FOLDER}/logs/collect.log",
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    message:
        "Collect the runs of the study"
    run:
        jobs.do_job("sandmould.study.collect:collect", Path(FOLDER), log=log[0])


rule calibrate:
    input:
        table=f"{FOLDER}/runs.tsv",
        summary=rules.collect.output.summary,
        also=ALSO,
    output:
        done=touch(f"{FOLDER}/sands_calibrated"),
    log:
        f"{FOLDER}/logs/calibrate.log",
    retries: 0
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    message:
        "Calibrate the sands of the study"
    run:
        jobs.do_job(
            "sandmould.study.calibration.run:write_calibration",
            Path(FOLDER),
            CALIBRATED,
            log=log[0],
        )


rule report:
    input:
        summary=rules.collect.output.summary,
        curves=rules.collect.output.curves,
        also=ALSO,
        templates=REPORT_TEMPLATES,
    output:
        html=report(
            f"{FOLDER}/report.html",
            caption="../report/findings.rst",
            category="Study",
            labels={"table": "findings, pictures, verdict"},
        ),
        verdict=f"{FOLDER}/verdict.txt",
        figures=report(
            directory(f"{FOLDER}/figures"),
            patterns=["{name}.svg", "{name}.png"],
            caption="../report/figure.rst",
            category="Study",
            subcategory="Figures",
        ),
    log:
        f"{FOLDER}/logs/report.log",
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    message:
        "Write the report {output.html}"
    run:
        jobs.do_job(
            "sandmould.report.page:write_report",
            Path(FOLDER),
            Path(output.html),
            log=log[0],
        )


rule check:
    input:
        summary=rules.collect.output.summary,
        # After the report, so that a failed run is shown there before it fails the study.
        report=rules.report.output.html,
    output:
        done=touch(f"{FOLDER}/all_runs_finished"),
    log:
        f"{FOLDER}/logs/check.log",
    # A run that failed fails again: only "sandmould again" has it computed once more.
    retries: 0
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    message:
        "Check that every run finished"
    run:
        jobs.do_job("sandmould.study.collect:failed_runs", Path(FOLDER), log=log[0])
