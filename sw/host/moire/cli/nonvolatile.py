# SPDX-License-Identifier: Apache-2.0
"""The commands `moire params save-to-node`, `forget` and `kept`: what a node has after a power cut.
The command line adds them to its parser:

add_to(actions, command)
"""

from dataclasses import asdict

from moire.client.nonvolatile import SavedSettings


def add_to(actions, command):
    """actions: the sub-parsers of `params`; command(name, handler, text, example, under): one of
    them.
    """
    command(
        "save-to-node",
        do_save_to_node,
        "keep the parameters of all axes, and the settings, in the EEPROM of the node for the next power-up",
        "moire --port /dev/ttyUSB0 params save-to-node",
        actions,
    )
    command(
        "restore-defaults",
        do_restore_defaults,
        "begin with the defaults at the next power-up",
        "moire --port /dev/ttyUSB0 params restore-defaults",
        actions,
    )
    command(
        "saved-in-node",
        do_saved_in_node,
        "whether what was kept is in force, and if not why",
        "moire --port /dev/ttyUSB0 params saved-in-node",
        actions,
    )


def saved_settings_of(session, options):
    return SavedSettings(session.bus.node(options.address))


def say(session, state):
    session.say({**asdict(state), "words": state.words}, state.words)


def do_save_to_node(session, options):
    say(session, saved_settings_of(session, options).save())


def do_restore_defaults(session, options):
    say(session, saved_settings_of(session, options).restore_defaults())


def do_saved_in_node(session, options):
    say(session, saved_settings_of(session, options).state())
