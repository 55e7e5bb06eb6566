"""`autd-trials schema`: JSON Schema for editors."""

import argparse

from autd_trials.commands.output import print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "kind", nargs="?", choices=("protocol", "rig"), default="protocol", help="of what (protocol)"
    )
    parser.add_argument(
        "--json", action="store_true", help="the output always is JSON; accepted for uniformity"
    )


def execute(options: argparse.Namespace) -> int:
    """Print the schema."""
    from autd_trials.protocol.schema import Protocol
    from autd_trials.rig.schema import Rig
    from autd_trials.yamlfile.json_schema import json_schema

    print_json(json_schema(Protocol if options.kind == "protocol" else Rig))
    return 0
