"""The section of docs/experiments.md about stress by true, least, greatest and found moduli. Standard library only."""
import plots
from page import IMAGES, machine, percent, results, table, with_truth

NAMES = {"truth": "true moduli", "soft": "least of them everywhere", "hard": "greatest of them everywhere", "found": "found"}
WIDTH, HEIGHT = 300, 130  # of a bar's picture [pixels]


def draw(figures):
    """The bars from the side, each cell in the colour of its stress, all on one scale."""
    pictures = figures["pictures"]
    corners = [p for one in pictures.values() for cell in one["outlines"] for p in cell]
    low_x, high_x, high_y = min(p[0] for p in corners), max(p[0] for p in corners), max(p[1] for p in corners)
    scale = WIDTH / (high_x - low_x)
    most = max(pictures["truth"]["stress"])
    height = scale * (high_y - min(p[1] for p in corners))
    parts = []
    for i, (name, one) in enumerate(pictures.items()):
        left, top = 20 + (WIDTH + 40) * (i % 2), 40 + (height + 50) * (i // 2)
        parts.append(f'<text x="{left}" y="{top - 10:.0f}">{NAMES[name]}</text>')
        for cell, stress in zip(one["outlines"], one["stress"]):
            points = " ".join(f"{left + scale * (x - low_x):.1f},{top + scale * (high_y - y):.1f}" for x, y in cell)
            parts.append(f'<polygon points="{points}" fill="{plots.shade(min(1.0, stress / most))}"/>')
    bar, base = 20, 40 + 2 * (height + 50)
    for i in range(60):
        parts.append(f'<rect x="{bar + 5 * i}" y="{base:.0f}" width="5.4" height="14" fill="{plots.shade(i / 59)}"/>')
    ticks = plots.even_ticks(most / 1e3)
    for tick in ticks:
        parts.append(f'<text x="{bar + 300 * tick / (most / 1e3):.0f}" y="{base + 30:.0f}" text-anchor="middle">{tick:g}</text>')
    parts.append(f'<text x="{bar + 315}" y="{base + 12:.0f}">von Mises stress [kPa]</text>')
    plots.write(IMAGES / "stress-fields.svg", 2 * WIDTH + 80, round(base + 45), parts)


def stress_fields():
    figures = results("stress-fields")
    if not figures:
        return "Not run yet.\n"
    truth, found = figures["truth"], {name: {**p, "truth": figures["truth"][name]} for name, p in figures["estimates"].items()}
    text = (f"Fitted in {figures['wall_seconds']:.0f} s: {with_truth(found['youngs_modulus'], 1e-3)} kPa in the held part (truth in brackets), {with_truth(found['youngs_modulus@free half'], 1e-3)} kPa in the free half, Poisson's ratio "
            f"{with_truth(found['poissons_ratio'])}. The same program made the recording, on another grid: an inverse crime. All four bars then hang in equilibrium on the fit's {figures['elements']} cells, each with the true "
            "density; the soft and the hard one have the true Poisson's ratio. Errors are root mean squares over the bar, by volume, over the greatest true value of an element; an element on the border of both parts mixes their moduli as the fit does.\n\n")
    text += table(["material", "von Mises stress off", "greatest principal strain off", "greatest von Mises stress [kPa]", "sag of the lowest point [mm]"],
                  [[NAMES[name], percent(r["stress"], False) if name != "truth" else "", percent(r["strain"], False) if name != "truth" else "", f"{1e-3 * r['greatest_stress']:.2f}", f"{1e3 * r['sag']:.1f}"]
                   for name, r in figures["materials"].items()])
    draw(figures)
    rows = figures["materials"]
    text += (f"\n![Stress in a bar of two stiffnesses by four materials](images/stress-fields.svg)\n\nWeight alone loads the bar, and how it bends says little about the stress that carries it: only what bends far changes its lever. So even a wrong "
             f"material is {percent(rows['hard']['stress'], False)} (hard) or {percent(rows['soft']['stress'], False)} (soft) off in stress; in strain it is {percent(rows['hard']['strain'], False)} and {percent(rows['soft']['strain'], False)}, what was found {percent(rows['found']['strain'], False)}. "
             f"Where motion is prescribed instead of forces, it is the stress that follows the modulus. (True moduli: {1e-3 * truth['youngs_modulus']:g} and {1e-3 * truth['youngs_modulus@free half']:g} kPa.)\n")
    return text + f"\nMeasured on {machine(figures)}.\n"
