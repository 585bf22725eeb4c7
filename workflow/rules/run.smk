# One run: its deck, its computation, its measures; or several runs in one job.
# What a run lacks is decided by what lies in its folder, not by times: a note that is newer than its
# products asks for them again (study/plan/lacking.py). A job writes what it reads of the plan.


rule render:
    input:
        note=compute_note_of,
    output:
        deck=f"{FOLDER}/runs/{{run}}/deck.in",
    log:
        f"{FOLDER}/logs/render_{{run}}.log",
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        **SUBMITTED,
        mem_mb=1000,
        runtime=SUBMISSION.runtime_min(10),
    message:
        "Render the deck of {wildcards.run}"
    run:
        jobs.do_job(
            "sandmould.execution.simulate:render_run",
            *planned(wildcards.run),
            log=log[0],
        )


rule fill:
    input:
        note=fill_note_of,
    output:
        outcome=f"{FOLDER}/fills/{{fill}}/outcome.json",
    log:
        f"{FOLDER}/logs/fill_{{fill}}.log",
    conda:
        "../envs/sandmould.yaml"
    threads: threads_of
    resources:
        **SUBMITTED,
        tasks=ranks_of,
        cpus_per_task=cpus_per_task_of,
        mpi=mpi_of,
        mem_mb=memory_mb_of,
        runtime=runtime_min_of,
    message:
        "Compute {wildcards.fill}, which runs share"
    run:
        jobs.compute_batch(
            planned(wildcards.fill),
            log[0],
            resources.tasks,
            resources.mpi,
        )


rule simulate:
    input:
        deck=rules.render.output.deck,
        note=compute_note_of,
        fill=fill_of,
    output:
        outcome=f"{FOLDER}/runs/{{run}}/outcome.json",
        products=f"{FOLDER}/runs/{{run}}/products.json",
        series=f"{FOLDER}/runs/{{run}}/series.tsv",
    log:
        f"{FOLDER}/logs/simulate_{{run}}.log",
    conda:
        "../envs/sandmould.yaml"
    threads: threads_of
    resources:
        **SUBMITTED,
        tasks=ranks_of,
        cpus_per_task=cpus_per_task_of,
        mpi=mpi_of,
        mem_mb=memory_mb_of,
        runtime=runtime_min_of,
    message:
        "Compute {wildcards.run}"
    run:
        jobs.compute_run(
            *planned(wildcards.run), log[0], resources.tasks, resources.mpi
        )


rule measure:
    input:
        series=rules.simulate.output.series,
        note=measure_note_of,
    output:
        measures=report(
            f"{FOLDER}/runs/{{run}}/measures.tsv",
            caption="../report/measures.rst",
            category="Runs",
            subcategory="Measures",
            labels=labels_of,
        ),
    log:
        f"{FOLDER}/logs/measure_{{run}}.log",
    # A run that is computed is measured before the next one begins: its value is seen at once.
    priority: 1
    conda:
        "../envs/sandmould.yaml"
    threads: 1
    resources:
        **SUBMITTED,
        mem_mb=2000,
        runtime=SUBMISSION.runtime_min(30),
    message:
        "Measure {wildcards.run}"
    run:
        jobs.do_job(
            "sandmould.execution.simulate:measure_run",
            *planned(wildcards.run),
            log=log[0],
        )


rule batch:
    input:
        notes=batch_notes_of,
        fills=batch_fills_of,
    output:
        done=touch(f"{FOLDER}/batches/{{batch}}.done"),
    log:
        f"{FOLDER}/logs/batch_{{batch}}.log",
    conda:
        "../envs/sandmould.yaml"
    threads: batch_threads_of
    resources:
        **SUBMITTED,
        tasks=batch_ranks_of,
        cpus_per_task=batch_cpus_per_task_of,
        mpi=batch_mpi_of,
        mem_mb=batch_memory_mb_of,
        runtime=batch_runtime_min_of,
    params:
        side_by_side=side_by_side_of,
    message:
        "Compute and measure the runs from {wildcards.batch} on"
    run:
        jobs.compute_batch(
            planned(*BATCHES[wildcards.batch]),
            log[0],
            resources.tasks,
            resources.mpi,
            params.side_by_side,
        )
