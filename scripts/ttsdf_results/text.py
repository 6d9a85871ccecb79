"""Tables and numbers as the pages write them."""


def markdown(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def aligned(lines):
    """For a terminal."""
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join("  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip() for line in lines)


def known(value):
    return value is not None and value == value  # not NaN


def millis(value):
    """Metres as millimetres, radians as milliradians."""
    if not known(value):
        return "-"
    return f"{1e3 * value:.1f}" if value < 0.0995 else f"{1e3 * value:.0f}"


def percent(value, digits=0):
    return f"{100 * value:.{digits}f}" if known(value) else "-"


def size(count):
    if count is None:
        return "-"
    if count < 1e5:
        return f"{count / 1e3:.1f} kB"
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"


def bold(text, really=True):
    return f"**{text}**" if really and text not in ("", "-") else text
