import csv
import json

from flow import FlowProject, aggregator


class Sweep(FlowProject):
    pass


@Sweep.post.isfile("result.json")
@Sweep.operation(cmd=True)
def run(job):
    return f"python one_run.py {job.sp.frequency_hz} {job.sp.seed} {job.fn('result.json')}"


@Sweep.pre(lambda *jobs: all(job.isfile("result.json") for job in jobs))
@Sweep.post(lambda *jobs: jobs[0].project.isfile("summary.tsv"))
@Sweep.operation(aggregator=aggregator())
def collect(*jobs):
    rows = [json.load(open(job.fn("result.json"))) for job in jobs]
    with open(jobs[0].project.fn("summary.tsv"), "w") as file:
        table = csv.DictWriter(file, list(rows[0]), delimiter="\t")
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    Sweep().main()
