"""`autd-trials plan`: the trials of a session, fixed before it starts."""

import argparse

from autd_trials.commands.output import print_json, print_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument(
        "--place", type=int, default=1, metavar="N", help="the participant's place in the roster (1)"
    )
    parser.add_argument("--session", type=int, default=1, metavar="N", help="the session's number (1)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the random order (1)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Print the plan."""
    from autd_trials.protocol.load import find_protocol, load_protocol
    from autd_trials.protocol.plan import make_plan, plan_to_tsv

    protocol = load_protocol(find_protocol(options.protocol))
    plan = make_plan(protocol, place=options.place, session=options.session, seed=options.seed)
    if options.json:
        print_json(plan.model_dump(mode="json"))
    else:
        print_text(plan_to_tsv(plan))
    return 0
