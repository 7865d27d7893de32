# SPDX-License-Identifier: Apache-2.0
"""The commands `moire params keep`, `forget` and `kept`: what a node has after a power cut. The command line adds them to its parser:

    add_to(actions, command)
"""
from dataclasses import asdict

from .keep import Kept


def add_to(actions, command):
    """actions: the sub-parsers of `params`; command(name, handler, text, example, under): one of them."""
    command("keep", do_keep, "keep the parameters of all axes, and the settings, in the EEPROM of the node for the next power-up",
            "moire --port /dev/ttyUSB0 params keep", actions)
    command("forget", do_forget, "begin with the defaults at the next power-up", "moire --port /dev/ttyUSB0 params forget", actions)
    command("kept", do_kept, "whether what was kept is in force, and if not why", "moire --port /dev/ttyUSB0 params kept", actions)


def kept_of(session, options):
    return Kept(session.line.node(options.address))


def say(session, state):
    session.say({**asdict(state), "words": state.words}, state.words)


def do_keep(session, options):
    say(session, kept_of(session, options).keep())


def do_forget(session, options):
    say(session, kept_of(session, options).forget())


def do_kept(session, options):
    say(session, kept_of(session, options).state())
