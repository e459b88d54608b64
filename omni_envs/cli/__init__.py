"""The ``omni-envs`` command: one file per subcommand."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import tyro

from omni_envs.cli.bench import Bench
from omni_envs.cli.convert import Convert
from omni_envs.cli.curves import Curves
from omni_envs.cli.demo import Demo
from omni_envs.cli.evaluate import Evaluate
from omni_envs.cli.export import Export
from omni_envs.cli.generate import Generate
from omni_envs.cli.list import List
from omni_envs.cli.publish import Publish
from omni_envs.cli.retarget import Retarget
from omni_envs.cli.skeleton import Skeleton
from omni_envs.cli.view import View
from omni_envs.errors import OmniEnvsError

Command = (
    Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Retarget, tyro.conf.subcommand("retarget")]
    | Annotated[Generate, tyro.conf.subcommand("generate")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Convert, tyro.conf.subcommand("convert")]
    | Annotated[Skeleton, tyro.conf.subcommand("skeleton")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Bench, tyro.conf.subcommand("bench")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Curves, tyro.conf.subcommand("curves")]
    | Annotated[Publish, tyro.conf.subcommand("publish")]
)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command line.

    Args:
        arguments: Words after the command's name; ``sys.argv`` by default.

    Returns:
        Exit status: 0 done, 1 could not do what was asked, 2 wrong usage (raised by the parser).
    """
    try:
        command = tyro.cli(
            Command,
            prog="omni-envs",
            args=arguments,
            config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
        )
        command.run()
        sys.stdout.flush()
    except BrokenPipeError:  # `omni-envs … | head` has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OmniEnvsError as error:
        print(f"omni-envs: {error}", file=sys.stderr)
        return 1
    except OSError as error:  # a folder that cannot be written, a full disk
        place = f"{error.filename}: " if error.filename else ""
        print(f"omni-envs: {place}{error.strerror or error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("omni-envs: interrupted", file=sys.stderr)
        return 1
    return 0
