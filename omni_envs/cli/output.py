"""What every command prints with."""

from __future__ import annotations

import json
from typing import Any

from rich.console import Console
from rich.table import Table

console = Console()


def show(title: str, rows: dict[str, Any], as_json: bool) -> None:
    """Prints figures as a table, or as one JSON object."""
    if as_json:
        print(json.dumps(rows, allow_nan=False))
        return
    table = Table(title=title, title_justify="left")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for key, value in rows.items():
        table.add_row(key, f"{value:.6g}" if isinstance(value, float) else str(value))
    console.print(table)
