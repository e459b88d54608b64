"""``omni-envs list``."""

from __future__ import annotations

import json
from dataclasses import dataclass

from omni_envs.cli.output import console


@dataclass
class List:
    """What there is: environments, robots, built-in demonstrations."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.demonstrations import builtin_names
        from omni_envs.registration import environment_ids
        from omni_envs.robots import robot_names

        what = {
            "environments": [env.id for robot in robot_names() for env in environment_ids(robot)],
            "robots": list(robot_names()),
            "demonstrations": list(builtin_names()),
        }
        if self.json:
            print(json.dumps(what))
            return
        for key, names in what.items():
            console.print(f"[bold]{key}[/bold]  {', '.join(names)}")
