"""The page and the plot of bench_peers.py: tables over what a `Bench` has measured.

Every program has a `kind`: "own" is brickmend, "peer" a peer, "start" a start without work.
"""

import measure

SOUNDNESS = ["boundary_edges", "nonmanifold_edges", "intersecting_pairs"]
COLOURS = ["#0b6e4f", "#c8553d", "#3a6ea5", "#8f5aa8", "#a07d1c", "#555555"]


def figures(bench):
    """The table of all figures."""
    head = ["depth", "program", "CPU s", "± %", "wall s", "peak MiB", "CPU s / M leaf cells", "faces"]
    rows = []
    for depth in bench.depths():
        millions = bench.grid(depth).get("leaf_cells", 0) / 1e6
        for tool in bench.tools:
            runs = bench.of(depth, tool.name)
            if not runs:
                words = {r["failure"] for r in bench.records if (r["depth"], r["tool"]) == (depth, tool.name)}
                rows.append([depth, tool.name, "; ".join(sorted(filter(None, words))) or "not run", *[""] * 5])
                continue
            cpu = bench.cpu(depth, tool.name)
            times = [record["cpu_seconds"] for record in runs]
            spread = 50 * (max(times) - min(times)) / max(cpu, 1e-9) if len(runs) > 1 else None
            wall = bench.middle(depth, tool.name, lambda r: r["wall_seconds"])
            peak = max(record["peak_bytes"] for record in runs) / 2**20
            rows.append([
                depth, tool.name, measure.short(cpu), measure.short(spread, 2), measure.short(wall),
                f"{peak:.0f}", measure.short(cpu / millions) if tool.kind != "start" and millions else "",
                measure.short(runs[0].get("faces")),
            ])
            if tool.kind == "own":
                less = bench.without_checks(depth, tool.name)
                each = measure.short(less / millions)
                rows.append([depth, f"{tool.name}, less proof and measuring", measure.short(less), "", "", "", each, ""])
    return measure.table(head, rows)


def ratios(bench):
    """The table of peers over brickmend (its first variant)."""
    head = [
        "depth", "peer", "CPU", "CPU, without the checks", "CPU, without either's extras", "wall", "memory",
    ]
    own, rows = bench.tools[0].name, []
    for depth in bench.depths():
        for tool in bench.tools:
            if tool.kind != "peer" or not bench.of(depth, tool.name) or not bench.of(depth, own):
                continue
            ours, bare = bench.cpu(depth, own), bench.without_checks(depth, own)
            pairs = [
                (bench.cpu(depth, tool.name), ours),
                (bench.cpu(depth, tool.name), bare),
                (bench.without_start(depth, tool.name), bare),
            ]
            for value in (lambda r: r["wall_seconds"], lambda r: r["peak_bytes"]):
                pairs.append((bench.middle(depth, tool.name, value), bench.middle(depth, own, value)))
            told = [f"{theirs / our:.2f}" if theirs is not None and our else "" for theirs, our in pairs]
            rows.append([depth, tool.name, *told])
    return measure.table(head, rows)


def soundness(bench):
    """The table of the judge's counts."""
    head = [
        "depth", "program", "triangles", "boundary edges", "non-manifold edges", "intersecting pairs", "outward",
    ]
    rows = []
    for words in bench.verdicts:
        if "failure" in words:
            rows.append([words["depth"], words["tool"], words["failure"], *[""] * 4])
            continue
        counts = [measure.short(words[name]) for name in ["triangles", *SOUNDNESS]]
        rows.append([words["depth"], words["tool"], *counts, "yes" if words["outward"] else "no"])
    return measure.table(head, rows)


def parts(bench):
    """The table of where processor time goes, as far as the programs tell."""
    rows = []
    for depth in bench.depths():
        for tool in bench.tools:
            runs = [r for r in bench.of(depth, tool.name) if r.get("parts")]
            if not runs or tool.kind == "start":
                continue
            each = [
                f"{name} {measure.short(measure.median([r['parts'][name] for r in runs]))}"
                for name in runs[0]["parts"]
            ]
            rows.append([depth, tool.name, ", ".join(each)])
    return measure.table(["depth", "program", "CPU s by part"], rows)


def page(bench):
    """The whole page."""
    start, arguments = bench.start, bench.arguments
    grid = bench.grid(bench.depths()[0])
    cells = ", ".join(
        f"{measure.short(bench.grid(d).get('leaf_cells'))} at depth {d}" for d in bench.depths()
    )
    rounds = f"median of {arguments.rounds} rounds, in turns" if arguments.rounds > 1 else "one round"
    if arguments.once_from:
        rounds += f"; one round from depth {arguments.once_from} on"
    lines = [
        "# brickmend beside its peers\n",
        "Written by `scripts/bench_peers.py`, which tells how each is run.\n",
        f"- Date: {start['date']}; load before the first run: {start['load']:.2f}",
        f"- Machine: {start['machine']}; {start['system']}",
        *[f"- {name}: {version}" for name, version in bench.versions.items()],
        f"- Mesh: {arguments.mesh.name}, {measure.short(grid.get('input_triangles'))} triangles",
        f"- Leaf cells: {cells}",
        f"- brickmend has `--max-memory {arguments.max_memory}` and all cores, like its peers",
        f"- Whole processes from file to file, {rounds}; ± is half of largest less smallest",
        f"- Peaks are the kernel's; one below {bench.floor_bytes / 2**20:.0f} MiB, the floor of this script, cannot be told\n",
        "![CPU seconds and peak memory over depth](peers.svg)\n" if bench.plotted else "",
        figures(bench),
        "## Ratios\n",
        f"The peer's figure over that of {bench.tools[0].name}: above 1, the peer takes more. The extras are"
        " brickmend's checks and Blender's start.\n",
        ratios(bench),
        "## Where the time goes\n",
        parts(bench),
    ]
    if bench.verdicts:
        lines += [
            "## Soundness\n",
            "Counted on the files as written, by a program that shares no code with any of these. Quads are"
            f" cut into triangles first. Deeper than {arguments.judge_depth} nothing was judged.\n",
            soundness(bench),
        ]
    return "\n".join(line for line in lines if line != "")


def plot(bench, path):
    """CPU seconds and peak memory over depth; False without matplotlib."""
    try:
        import matplotlib
    except ImportError:
        return False
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "peers"
    import matplotlib.pyplot as plt
    from matplotlib import ticker

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.8), layout="constrained")
    shown = [tool for tool in bench.tools if tool.kind != "start"]
    for tool, colour in zip(shown, COLOURS * len(shown)):
        less = bench.without_checks if tool.kind == "own" else bench.without_start
        extra = "without its checks" if tool.kind == "own" else "without its start"
        style = {"color": colour, "marker": "o", "markersize": 4}
        draw(left, bench, tool.name, bench.cpu, {**style, "label": tool.name})
        if tool.kind == "own" or tool.starts:
            dashed = {**style, "linestyle": "--", "marker": None, "label": f"{tool.name}, {extra}"}
            draw(left, bench, tool.name, less, dashed)
        peak = lambda d, n: bench.middle(d, n, lambda r: r["peak_bytes"] / 2**20)
        draw(right, bench, tool.name, peak, style)
    for axes, title in ((left, "CPU seconds, user and system"), (right, "Peak resident memory, MiB")):
        axes.set(yscale="log", xticks=bench.depths(), xlabel="octree depth", title=title)
        axes.yaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(ticker.NullFormatter())
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    budget = bench.grid(bench.depths()[0]).get("budget_bytes")
    if budget:
        style = {"color": COLOURS[0], "linestyle": ":", "label": "brickmend's --max-memory"}
        right.axhline(budget / 2**20, **style)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    plt.close(figure)
    return True


def draw(axes, bench, name, value, style):
    """One line over the depths that have a figure."""
    points = [(d, value(d, name)) for d in bench.depths()]
    points = [(d, v) for d, v in points if v is not None and v > 0]
    if points:
        axes.plot(*zip(*points), **style)
