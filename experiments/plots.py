"""Small plots as SVG: lines over logarithmic axes, heat maps, and marks over even axes. Standard library only."""
import math

COLOURS = ("#1f5fa8", "#b5401f", "#3a8a3a", "#7a4fa0", "#a07800", "#4a4a4a")
FONT = 'font-family="sans-serif" font-size="12"'


def decades(low, high):
    """Powers of ten within a range of logarithms, at most about eight of them."""
    first, last = math.ceil(low - 1e-9), math.floor(high + 1e-9)
    stride = max(1, math.ceil((last - first + 1) / 8))
    return range(first, last + 1, stride)


def power(n):
    return f'10<tspan dy="-5" font-size="9">{n}</tspan>'


class Panel:
    """A frame in which values stand by their logarithm to base ten."""

    def __init__(self, left, top, width, height, x_range, y_range):
        self.left, self.top, self.width, self.height = left, top, width, height
        self.x_range, self.y_range, self.parts = x_range, y_range, []

    def x(self, value):
        low, high = self.x_range
        return self.left + self.width * (math.log10(value) - low) / (high - low)

    def y(self, value):
        low, high = self.y_range
        return self.top + self.height * (high - math.log10(value)) / (high - low)

    def axes(self, x_label, y_label):
        bottom, right = self.top + self.height, self.left + self.width
        for n in decades(*self.x_range):
            x = self.x(10.0**n)
            self.parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{bottom}" y2="{bottom + 5}" stroke="#666"/>'
                              f'<text x="{x:.1f}" y="{bottom + 21}" text-anchor="middle">{power(n)}</text>')
        for n in decades(*self.y_range):
            y = self.y(10.0**n)
            self.parts.append(f'<line x1="{self.left - 5}" x2="{self.left}" y1="{y:.1f}" y2="{y:.1f}" stroke="#666"/>'
                              f'<text x="{self.left - 8}" y="{y + 4:.1f}" text-anchor="end">{power(n)}</text>')
        middle = self.top + self.height / 2
        self.parts.append(f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}" fill="none" stroke="#999"/>'
                          f'<text x="{(self.left + right) / 2:.0f}" y="{bottom + 40}" text-anchor="middle">{x_label}</text>'
                          f'<text transform="translate({self.left - 46} {middle:.0f}) rotate(-90)" text-anchor="middle">{y_label}</text>')

    def line(self, points, colour, label, number, dashed=False):
        """A curve, and its name in the lower right corner; points that are not positive end a stretch of it."""
        stretches, dash = [[]], ' stroke-dasharray="6 4"' if dashed else ""
        for x, y in points:
            if y is None or y <= 0:
                stretches.append([])
            else:
                at_floor = max(y, 10.0**self.y_range[0])
                stretches[-1].append(f"{self.x(x):.1f},{self.y(at_floor):.1f}")
        for stretch in filter(None, stretches):
            self.parts.append(f'<polyline points="{" ".join(stretch)}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
        x, y = self.left + self.width - 215, self.top + self.height - 12 - 17 * number
        self.parts.append(f'<line x1="{x}" x2="{x + 26}" y1="{y - 4}" y2="{y - 4}" stroke="{colour}" stroke-width="2"{dash}/>'
                          f'<text x="{x + 32}" y="{y}">{label}</text>')

    def vertical(self, value, colour="#999"):
        x = self.x(value)
        self.parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{self.top}" y2="{self.top + self.height}" stroke="{colour}" stroke-dasharray="3 3"/>')

    def cell(self, x, y, colour):
        """A rectangle between two values each way."""
        left, right, low, high = self.x(x[0]), self.x(x[1]), self.y(y[0]), self.y(y[1])
        self.parts.append(f'<rect x="{left:.1f}" y="{high:.1f}" width="{right - left + 0.4:.1f}" height="{low - high + 0.4:.1f}" fill="{colour}"/>')

    def cross(self, x, y):
        at_x, at_y = self.x(x), self.y(y)
        for dy in (-6, 6):
            self.parts.append(f'<line x1="{at_x - 6:.1f}" x2="{at_x + 6:.1f}" y1="{at_y - dy:.1f}" y2="{at_y + dy:.1f}" stroke="#fff" stroke-width="4"/>')
        for dy in (-6, 6):
            self.parts.append(f'<line x1="{at_x - 6:.1f}" x2="{at_x + 6:.1f}" y1="{at_y - dy:.1f}" y2="{at_y + dy:.1f}" stroke="#c00" stroke-width="2"/>')


class EvenPanel(Panel):
    """A frame in which values stand as they are, from zero on each axis."""

    def __init__(self, left, top, width, height, x_most, y_most):
        super().__init__(left, top, width, height, (0.0, x_most), (0.0, y_most))

    def x(self, value):
        return self.left + self.width * value / self.x_range[1]

    def y(self, value):
        return self.top + self.height * (1.0 - value / self.y_range[1])

    def axes(self, x_label, y_label):
        bottom, right, middle = self.top + self.height, self.left + self.width, self.top + self.height / 2
        for value in even_ticks(self.x_range[1]):
            x = self.x(value)
            self.parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{bottom}" y2="{bottom + 5}" stroke="#666"/>'
                              f'<text x="{x:.1f}" y="{bottom + 19}" text-anchor="middle">{value:g}</text>')
        for value in even_ticks(self.y_range[1]):
            y = self.y(value)
            self.parts.append(f'<line x1="{self.left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="#eee"/>'
                              f'<text x="{self.left - 8}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
        self.parts.append(f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}" fill="none" stroke="#999"/>'
                          f'<text x="{(self.left + right) / 2:.0f}" y="{bottom + 38}" text-anchor="middle">{x_label}</text>'
                          f'<text transform="translate({self.left - 42} {middle:.0f}) rotate(-90)" text-anchor="middle">{y_label}</text>')

    def mark(self, x, y, colour, filled=True):
        self.parts.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="3.5" fill="{colour if filled else "none"}" stroke="{colour}" stroke-width="1.5"/>')

    def key(self, number, colour, label):
        """The name of a colour of marks, in the upper left corner."""
        x, y = self.left + 16, self.top + 20 + 17 * number
        self.parts.append(f'<circle cx="{x}" cy="{y - 4}" r="3.5" fill="{colour}" stroke="{colour}"/><text x="{x + 12}" y="{y}">{label}</text>')


def even_ticks(most):
    """Round values from zero to `most`, four to ten of them."""
    step = 10.0**math.floor(math.log10(most / 4.0))
    step *= max(m for m in (1, 2, 5) if m * step <= most / 4.0)
    return [step * k for k in range(math.floor(most / step + 1e-9) + 1)]


def shade(share):
    """From dark blue (0) over green to light yellow (1)."""
    stops = [(0.0, (35, 30, 90)), (0.35, (35, 110, 140)), (0.7, (95, 190, 110)), (1.0, (250, 235, 120))]
    for (a, low), (b, high) in zip(stops, stops[1:]):
        if share <= b:
            t = (share - a) / (b - a)
            return "#" + "".join(f"{round(l + t * (h - l)):02x}" for l, h in zip(low, high))
    return "#faeb78"


made = {}  # text of each picture by its path, until `make_docs.py` writes or compares them


def write(path, width, height, parts):
    made[path] = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" {FONT}>\n<rect width="100%" height="100%" fill="#fff"/>\n'
                    + "\n".join(parts) + "\n</svg>\n")
