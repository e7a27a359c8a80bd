"""Curves over data: pictures for docs/experiments.md. Needs matplotlib."""
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

COLOURS = ("#1f5fa8", "#b5401f", "#3a8a3a", "#7a4fa0", "#a07800", "#4a4a4a", "#008b8b", "#c2185b")


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    plt.close(figure)


def silicones(drawn, path):
    figure, panels = plt.subplots(3, 5, figsize=(16, 8.5))
    for panel, (name, rows, fits) in zip(panels.flat, drawn):
        x = [r[0] - 1 for r in rows]
        panel.plot(x[::6], [r[1] / 1e6 for r in rows][::6], ".", color="#999", ms=4, label="measured")
        panel.plot(x, [s / 1e6 for s in fits["ogden"]], color=COLOURS[0], label="Ogden")
        panel.plot(x, [s / 1e6 for s in fits["linear"]], "--", color=COLOURS[1], label="linear, whole curve")
        panel.plot(x, [s / 1e6 for s in fits["linear, small"]], ":", color=COLOURS[2], label="linear, to 50 %")
        panel.set_title(name, fontsize=10)
        panel.set_ylim(0, 1.15 * max(r[1] for r in rows) / 1e6)
    for panel in panels.flat[len(drawn):]:
        panel.axis("off")
    panels.flat[len(drawn)].legend(*panels.flat[0].get_legend_handles_labels(), loc="center")
    figure.supxlabel("strain (nominal)", fontsize=10)
    figure.supylabel("nominal stress [MPa]", fontsize=10)
    save(figure, path)


def multiaxial(drawn, path, shown, scale, unit):
    rows = (len(shown) + 3) // 4
    figure, panels = plt.subplots(rows, 4, figsize=(16, 4 * rows), squeeze=False)
    by_name = {name: (tests, fits) for name, tests, fits in drawn}
    for panel, name in zip(panels.flat, shown):
        tests, fits = by_name[name]
        low, high = min(min(t["stress"]) for t in tests) / scale, max(max(t["stress"]) for t in tests) / scale
        for i, t in enumerate(tests):
            order = sorted(range(len(t["stretch"])), key=lambda k: t["stretch"][k])
            colour = COLOURS[i % len(COLOURS)]
            of = lambda values: [values[k] / scale if values[k] is not None else float("nan") for k in order]
            x = of([s * scale for s in t["stretch"]])
            label = t["name"].replace("_", " ").replace("lambda ", "").replace("1d", "1.").replace("2d", "2.") if len(tests) < 9 else None
            panel.plot(x, of(t["stress"]), ".", color=colour, ms=5, label=label)
            panel.plot(x, of(fits["all"]["stress"][i]), color=colour, lw=1.2)
            panel.plot(x, of(fits["one mode"]["stress"][i]), "--", color=colour, lw=1)
        panel.set_ylim(low - 0.08 * (high - low), high + 0.15 * (high - low))
        panel.set_title(name, fontsize=10)
        if len(tests) < 9:
            panel.legend(fontsize=7)
    for panel in panels.flat[len(shown):]:
        panel.axis("off")
    figure.supxlabel("stretch or shear", fontsize=10)
    figure.supylabel(f"stress [{unit}]", fontsize=10)
    save(figure, path)


def foam(drawn, path):
    tests, fits = drawn
    figure, panels = plt.subplots(1, 3, figsize=(15, 4.5))
    for i, (panel, t, title) in enumerate(zip(panels, tests, ("tension", "compression", "simple shear"))):
        panel.plot(t["stretch"], [s / 1e3 for s in t["stress"]], ".", color="#999", ms=4, label="measured")
        for colour, style, (name, f) in zip(COLOURS, ("-", "--", ":", "-."), fits.items()):
            panel.plot(t["stretch"], [s / 1e3 if s is not None else float("nan") for s in f["stress"][i]], style, color=colour, label=name)
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("shear" if i == 2 else "stretch")
        low, high = min(t["stress"]) / 1e3, max(t["stress"]) / 1e3
        panel.set_ylim(low - 0.4 * (high - low), high + 0.4 * (high - low))
    panels[0].set_ylabel("nominal stress [kPa]")
    panels[0].legend(fontsize=8)
    save(figure, path)


def draw(drawn, images):
    silicones(drawn["silicones"], images / "material-silicones.png")
    names = [name for name, _, _ in drawn["multiaxial"]]
    multiaxial(drawn["multiaxial"], images / "material-rubbers.png", [n for n in names if "Budday" not in n and "Katashima" not in n], 1e6, "MPa")
    multiaxial(drawn["multiaxial"], images / "material-brain-gel.png", [n for n in names if "Budday" in n or "Katashima" in n], 1e3, "kPa")
    foam(drawn["foam"], images / "material-foam.png")
