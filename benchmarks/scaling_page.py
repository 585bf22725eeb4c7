"""The page docs/scaling.md, written from what was measured."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Any

from benchmarks.scaling_page_beside import beside, cluster
from benchmarks.tables import number, table

TEXT = Path(__file__).with_suffix(".md")


def _s(value: float) -> str:
    return f"{value:.1f}" if value < 100 else number(round(value))


def _mb(value: float) -> str:
    return number(round(value / 1e6))


def _cpu(row: dict[str, Any], name: str, of: str = "cpu_s") -> str:
    if name not in row:
        return "–"
    return _mb(row[name][of]) if of == "peak_memory_bytes" else _s(row[name][of])


def _measured(found: dict[str, Any]) -> str:
    sizes = sorted(found["rows"], key=int)
    rows = [found["rows"][size] for size in sizes]

    def line(what: str, cells: list[str]) -> list[str]:
        return [what, *cells]

    def run(row: dict[str, Any], name: str) -> str:
        if name not in row:
            return "–"
        runs = int(sizes[rows.index(row)])
        return f"{_s(row[name]['cpu_s'])} ({row[name]['cpu_s'] / runs:.2f} a run)"

    lines = [
        line("validate and expand", [_s(r["validate_s"]) for r in rows]),
        line("write the plan", [_s(r["write_s"]) for r in rows]),
        line("plan again, unchanged", [_s(r["write_again_s"]) for r in rows]),
        line("dry run, shared jobs", [_cpu(r, "graph_shared") for r in rows]),
        line("its memory, MB", [_cpu(r, "graph_shared", "peak_memory_bytes") for r in rows]),
        line("dry run, three jobs a run", [_cpu(r, "graph_alone") for r in rows]),
        line("its memory, MB", [_cpu(r, "graph_alone", "peak_memory_bytes") for r in rows]),
        line("whole study, three jobs a run", [run(r, "run_alone") for r in rows]),
        line("whole study, shared jobs", [run(r, "run_shared") for r in rows]),
        line("wall time of it on two cores, s", [_cpu(r, "run_shared", "wall_s") for r in rows]),
        line("graph, collection and report, a run", [
            f"{_of_workflow(r) / int(size):.3f}" for size, r in zip(sizes, rows, strict=True)
        ]),
        line("the same command again: nothing to do", [_cpu(r, "nothing_to_do") for r in rows]),
        line("one more point, to its report", [
            f"{_cpu(r, 'append')} ({r['append']['runs']} runs)" if "append" in r else "–"
            for r in rows
        ]),
        line("`make status`", [_cpu(r, "status") for r in rows]),
        line("collection", [_cpu(r, "collect") for r in rows]),
        line("its memory, MB", [_cpu(r, "collect", "peak_memory_bytes") for r in rows]),
        line("report", [_cpu(r, "report") for r in rows]),
        line("its memory, MB", [_cpu(r, "report", "peak_memory_bytes") for r in rows]),
        line("files of its runs", [number(_files_of_runs(found, size)) for size in sizes]),
        line("size of the page, MB", [f"{r['report_bytes'] / 1e6:.1f}" for r in rows]),
    ]  # fmt: skip
    return table(["runs", *(number(int(size)) for size in sizes)], lines)


def _of_workflow(row: dict[str, Any]) -> float:
    """Seconds of a core that are no run's, of a study with shared jobs."""
    return sum(float(row[name]["cpu_s"]) for name in ("graph_shared", "collect", "report"))


def _files_of_runs(found: dict[str, Any], size: str) -> int:
    row = found["rows"][size]
    if "files" in row:
        return round(int(size) * row["files"]["files"])
    return int(row["linked_files"]) + int(size)  # The run's scenario is written and not linked.


def _parts(found: dict[str, Any]) -> str:
    part = found["parts"]
    python, preamble = part["start of Python"], part["preamble of a script"]
    alone, shared = _overhead(found, "run_alone"), _overhead(found, "run_shared")
    process = part["process of a run"] - python - part["imports of a run"]
    lines = [
        ["starts of Python: three scripts and the run's own process", 4 * python],
        ["Snakemake's preamble of three scripts", 3 * preamble],
        ["imports of the script that renders", part["imports of a run"]],
        ["imports of the run's own process", part["imports of a run"]],
        ["imports of the script that measures", part["imports of measuring"]],
        ["the run's process beside imports: kernels, the loop, records, provenance", process],
        ["rendering", part["rendering"]],
        ["measuring, pictures, exports", part["measuring"]],
    ]
    known = sum(value for _, value in lines)
    head = ["a run with three jobs", "s of a core", "share"]
    body = [[name, f"{value:.2f}", f"{value / known:.0%}"] for name, value in lines]
    body.append(["sum of these", f"{known:.2f}", ""])
    imports = 2 * part["imports of a run"] + part["imports of measuring"]
    rest = "Snakemake's own work, collection and report"
    if alone > known:
        whole = f"of which the other {alone - known:.2f} s are {rest}"
    else:
        whole = (
            f"{known - alone:.2f} s less than the sum, although {rest} are in it: parts measured "
            "by themselves, at another time, are no more exact than that"
        )
    return (
        f"{table(head, body)}\nImports are {imports / known:.0%} of it. A run of the whole study "
        f"took {alone:.2f} s, {whole}. In shared jobs a run takes {shared:.2f} s: the job imports "
        "once for all its runs, and each run keeps a process of its own, so that one that crashes "
        "takes no other with it.\n"
    )


def _largest(found: dict[str, Any], name: str) -> str:
    return max((size for size, row in found["rows"].items() if name in row), key=int)


def _overhead(found: dict[str, Any], name: str) -> float:
    """Seconds of a core that a run of the stand-in takes, without the start of Snakemake."""
    size = _largest(found, name)
    row = found["rows"][size]
    return (row[name]["cpu_s"] - row["nothing_to_do"]["cpu_s"]) / int(size)


def _files(found: dict[str, Any]) -> str:
    of = found["rows"][_largest(found, "files")]["files"]
    own, taken = of["files"] - of["of_snapshots"], of["bytes"] - of["bytes_of_snapshots"]
    return (
        f"A run leaves {of['files']:.0f} files of {of['bytes'] / 1e3:.0f} kB: {own:.0f} of "
        f"{taken / 1e3:.0f} kB and {of['of_snapshots']:.0f} snapshots and exports, which go with "
        f"what the study records. Beside it lie {of['logs']:.1f} logs and "
        f"{of['of_snakemake']:.1f} files of Snakemake's own. 10 000 runs are thus "
        f"{number(round(10 * (of['files'] + of['logs'] + of['of_snakemake'])))} thousand files, "
        "where many clusters allow a user a million.\n"
    )


def _broke(found: dict[str, Any]) -> dict[str, str]:
    fewest, runs = min(found["rows"], key=int), max(found["rows"], key=int)
    most, before = found["rows"][runs], found["before"]
    jobs = 3 * (int(runs) - int(fewest))

    def of_a_job(of: str) -> float:
        return (most["graph_alone"][of] - found["rows"][fewest]["graph_alone"][of]) / jobs

    def told(cost: dict[str, Any]) -> str:
        return f"{_s(cost['cpu_s'])} s, {_mb(cost['peak_memory_bytes'])} MB"

    return {
        "graph_before": told(before["graph"]),
        "pattern_before": _s(before["graph_pattern_s"]),
        "report_before": f"{told(before['report'])}, a page of "
        f"{before['report_bytes'] / 1e6:.0f} MB",
        "run_before": f"{before['run_cpu_s']:.1f} s",
        "commit_before": before["commit"],
        "processor_before": before["processor"],
        "job_kb": f"{of_a_job('peak_memory_bytes') / 1e3:.0f}",
        "job_ms": f"{of_a_job('cpu_s') * 1e3:.1f}",
        "graph_now": told(most["graph_alone"]),
        "shared_now": told(most["graph_shared"]),
        "report_now": f"{told(most['report'])}, a page of {most['report_bytes'] / 1e6:.1f} MB",
        "run_now": f"{_overhead(found, 'run_shared'):.1f} s in a shared job, "
        f"{_overhead(found, 'run_alone'):.1f} s with three of its own",
    }


def _machine(found: dict[str, Any]) -> str:
    origin = found["provenance"]
    machine = origin["machine"]
    rows = [
        ["processor", f"{machine['processor']}, {machine['cores']} cores"],
        ["system", machine["system"]],
        ["commit", origin["commit"]],
        ["versions", ", ".join(f"{k} {v}" for k, v in origin["versions"].items())],
        ["peers", ", ".join(f"{k} {v}" for k, v in found["peers"]["versions"].items())],
        ["took", f"{found['took_s'] / 60:.0f} min, load {found['load_before']:.1f} before and "
         f"{found['load_after']:.1f} after"],
    ]  # fmt: skip
    return table(["", ""], rows)


def page(found: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    found : dict
        What ``benchmarks.scaling`` measured.
    """
    values = {
        "measured": _measured(found),
        "parts": _parts(found),
        "files": _files(found),
        "machine": _machine(found),
        **_broke(found),
        **cluster(found),
        **beside(found),
    }
    return Template(TEXT.read_text(encoding="utf-8")).substitute(values)
