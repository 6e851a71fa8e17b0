"""Writes `scene.toml` files."""

from pathlib import Path


def write_scene(path, description):
    """Writes a description: tables of plain values, and lists of tables."""
    lines = []
    for key, value in description.items():
        tables = value if isinstance(value, list) else [value]
        for table in tables:
            lines.append(f"[[{key}]]" if isinstance(value, list) else f"[{key}]")
            lines += [f"{name} = {_value(entry)}" for name, entry in table.items()]
            lines.append("")
    Path(path).write_text("\n".join(lines))


def _value(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {_value(entry)}" for name, entry in value.items()) + " }"
    return repr(value)
