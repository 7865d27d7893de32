# SPDX-License-Identifier: Apache-2.0
"""The grammar of the command line. Commands are click commands, joined by `--` into a chain. A
chain is parsed completely before its first command is carried out.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import click

from moire.cli import commands
from moire.cli.commands import MODULES, SECTIONS
from moire.cli.files import OutputError
from moire.cli.options import COMMON, GIVEN, OF_THE_CALL, OF_THE_PORT, Common, Options
from moire.cli.values import marked
from moire.description import Description
from moire.errors import MoireError
from moire.nearest import did_you_mean, near_names

EXAMPLES = """\
Several commands in one call have -- between them:
  moire --port twin home -- move 1mm -- status
  moire --port /dev/ttyUSB0 reset -- home -- move 200um -- move -50nm --by

With a machine.toml, axes have names; so have those of a simulated machine:
  moire --port twin:s2 home x -- move x 1mm -- status y

Lengths are written with pm nm um mm cm m (1.5mm, 200um, 50nm), speeds as 5mm/s, times as 20ms.

--port twin is the built-in simulated stage and --port twin:s2 another machine (see: moire twin
--help). It powers up from scratch in every call, so write all commands in one call, or use 'run
FILE' or 'shell'. Options before or in the first command hold for all commands that follow;
--address and --axis may be given again in each.

A drive stays on only while the host talks to its node. At its end a call switches off every drive
that it has switched on.

Exit codes: 0 done; 1 the node refused, or a motion ended badly; 2 wrong usage, value or file;
3 nobody answers, or the bus is garbled; 4 the port does not work; 5 node and host were made from
different sources; 130 Ctrl-C, 143 SIGTERM, 129 SIGHUP: a moving axis was stopped under control.

Completion of commands, options and names by the Tab key, for bash (or zsh, fish):
  eval "$(_MOIRE_COMPLETE=bash_source moire)"
"""
NO_NAMES = Description()
STANDS_ALONE = ("run", "serve", "shell", "twin", "study")


class UsageError(MoireError):
    """The command line is wrong. `command` is the command that is wrong, where there is one."""

    exit_code = 2

    def __init__(self, sentence: str, command: str | None = None) -> None:
        super().__init__(sentence)
        if command is not None:
            self.command = command


@dataclass(frozen=True)
class Planned:
    """A command that has been parsed and not yet carried out."""

    name: str
    action: str | None
    options: Options
    handler: Callable[..., None]
    arguments: Mapping[str, Any]
    given: Mapping[str, Any]  # the options of every command that its own part names


class Several(click.Option):
    """An option that takes all values up to the next option: --nodes 1 2 3."""

    def __init__(self, names: Sequence[str], **settings: Any) -> None:
        super().__init__(names, **{**settings, "multiple": True})


class Parsed(click.Command):
    """What the commands and the groups have in common: the texts of --help."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options of every command have a section of their own."""
        parameters = self.get_params(ctx)
        own = [each for each in parameters if not isinstance(each, Common | click.Argument)]
        common = [each for each in parameters if isinstance(each, Common)]
        for title, options in (("Options", own), ("Options of every command", common)):
            records = [record for each in options if (record := each.get_help_record(ctx))]
            with formatter.section(title):
                formatter.write_dl(records)
        if isinstance(self, click.Group):
            self.format_commands(ctx, formatter)


class Command(Parsed):
    """A command, whose help is one full sentence. It yields what is planned instead of doing it."""

    def __init__(
        self,
        name: str | None,
        *,
        help: str,
        example: str,
        check: Callable[[Mapping[str, Any]], str | None] | None = None,
        **settings: Any,
    ) -> None:
        """`check` returns what is wrong with the arguments together, or None."""
        super().__init__(name, help=help, short_help=help, epilog=f"example: {example}", **settings)
        own = {name for option in self.params for name in option.opts}
        self.params += [each.without(own) for each in COMMON]
        self.example, self.check = example, check
        self.allow_extra_args = True  # invoke() refuses them in a better sentence

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the name of an option that takes several values in front of each of them."""
        for option in self.params:
            if isinstance(option, Several):
                args = repeated(option.opts, args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Planned:
        """The plan; click calls this when the command line is right."""
        assert self.callback is not None
        if ctx.args:
            raise click.UsageError(f"'{ctx.args[0].strip()}' is one argument too many", ctx)
        if self.check is not None and (wrong := self.check(ctx.params)):
            raise click.UsageError(wrong, ctx)
        names = names_of(ctx)
        given = ctx.meta.get(GIVEN, {})
        action = names[1] if len(names) > 1 else None
        return Planned(names[0], action, Options(), self.callback, ctx.params, dict(given))


class Group(Parsed, click.Group):
    """A command with actions, or `moire` itself with its commands."""

    command_class = Command

    def __init__(
        self,
        name: str | None = None,
        *,
        help: str,
        part: str = "ACTION",
        example: str = "",
        **settings: Any,
    ) -> None:
        """`part` is what the help calls a command of the group."""
        super().__init__(
            name,
            help=help,
            short_help=help,
            epilog=f"example: {example}",
            invoke_without_command=True,
            callback=self.require_part,
            subcommand_metavar=f"{part} ...",
            **settings,
        )
        self.params += COMMON
        self.part, self.example = part, example

    def require_part(self, **_: Any) -> None:
        """Refuse a group without one of its commands."""
        context = click.get_current_context()
        if context.invoked_subcommand is None:
            article = "an" if self.part == "ACTION" else "a"
            raise click.UsageError(f"{article} {self.part} is missing", context)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order in which they were made."""
        return list(self.commands)


class Moire(Group):
    """The command `moire`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order of the sections."""
        return list(MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command, whose module is imported when it is first used; None if there is none."""
        if cmd_name in MODULES:
            import_module(f"{commands.__name__}.{MODULES[cmd_name]}")
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The commands by section."""
        for title, names in SECTIONS.items():
            with formatter.section(title):
                made = {name: self.get_command(ctx, name) for name in names}
                formatter.write_dl(
                    [(name, each.get_short_help_str()) for name, each in made.items() if each]
                )

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The examples keep their lines."""
        formatter.write("\n" + EXAMPLES)


moire = Moire(
    "moire",
    help="Find, home and move the axes of Moire motion controllers, and read what they measure.",
    part="COMMAND",
    context_settings={"max_content_width": 100},
)
click.version_option(package_name="moire", message="%(prog)s %(version)s")(moire)


def repeated(names: list[str], arguments: list[str]) -> list[str]:
    """Arguments, in which each value of an option with several values has the option before it."""
    out: list[str] = []
    option = None
    for argument in arguments:
        if argument.startswith("-"):
            option = argument if argument in names else None
            out += [] if option else [argument]
        else:
            out += [option, argument] if option else [argument]
    if arguments and arguments[-1] in names:
        out.append(arguments[-1])  # click says that its value is missing
    return out


def names_of(context: click.Context) -> list[str]:
    """The names of the command and of its action."""
    return context.command_path.split()[1:]


def split(arguments: list[str]) -> list[list[str]]:
    """The commands between the `--`."""
    parts: list[list[str]] = [[]]
    for argument in arguments:
        if argument == "--":
            parts.append([])
        else:
            parts[-1].append(marked(argument))
    if not all(parts):
        where = " beside --" if len(parts) > 1 else ""
        raise UsageError(f"a command is missing{where} (see: moire --help)")
    return parts


def with_places(part: list[str], description: Description) -> list[str]:
    """One command, in which the name of an axis has become the options --address and --axis. It
    stands behind --axis, or after the command and its action; 'start' takes several.
    """
    axes, after = description.axes, 0
    if not axes:
        return part
    for at, word in enumerate(part):
        if word in MODULES and word not in STANDS_ALONE:
            command = moire.get_command(click.Context(moire), word)
            after = at + 1 + isinstance(command, Group)
            break
    out: list[str] = []
    for at, word in enumerate(part):
        known = axes.get(word)
        if known and out and out[-1] == "--axis":
            out[-1:] = ["--address", str(known.node), "--axis", str(known.axis)]
        elif known and after and part[after - 1] == "start" and at >= after:
            out.append(f"{known.node}.{known.axis}")
        elif known and after and at == after:
            out += ["--address", str(known.node), "--axis", str(known.axis)]
        else:
            out.append(word)
    return out


def parse_part(part: list[str], description: Description) -> Planned:
    """One command. SystemExit after --help or --version, which click has printed."""
    try:
        part = with_places(part, description)
        planned = moire.main(part, prog_name="moire", standalone_mode=False)
    except OSError as error:  # of --help
        raise OutputError(error) from None
    except click.Abort:  # Ctrl-C
        raise KeyboardInterrupt from None
    except click.UsageError as error:
        name = names_of(error.ctx)[:1] if error.ctx else []
        if not name and isinstance(error, click.exceptions.NoSuchCommand):
            name = [error.command_name]
        name += [word for word in part if word in MODULES]
        path = error.ctx.command_path if error.ctx else " ".join(["moire", *name[:1]])
        raise UsageError(
            f"{sentence(error)} (see: {path} --help)", next(iter(name), None)
        ) from None
    if not isinstance(planned, Planned):
        raise SystemExit(0)
    return planned


def sentence(error: click.UsageError) -> str:
    """What is wrong, in the words of all other errors of `moire`."""
    text = error.message
    if isinstance(error, click.exceptions.NoSuchCommand) and error.ctx:
        group = error.ctx.command
        known = group.list_commands(error.ctx) if isinstance(group, click.Group) else ()
        near = did_you_mean(near_names(error.command_name, known))
        return f"there is no command '{error.command_name}'{near}"
    if isinstance(error, click.NoSuchOption):
        return f"there is no option '{error.option_name}'{did_you_mean(error.possibilities or ())}"
    if isinstance(error, click.MissingParameter) and error.param:
        return f"{name_of(error.param)} is missing"
    if isinstance(error, click.BadParameter) and error.param:
        return f"{name_of(error.param)}: {text}"
    return text[:1].lower() + text[1:].removesuffix(".")


def name_of(parameter: click.Parameter) -> str:
    """What the user knows a parameter by: --bandwidth or LENGTH."""
    if isinstance(parameter, click.Option):
        return parameter.opts[-1]
    return parameter.metavar or parameter.human_readable_name


def parse(arguments: list[str], before: Options, description: Description) -> list[Planned]:
    """The commands of a chain. The options of the first command hold for all; the options of the
    port and --json hold for the whole chain wherever they are given.
    """
    planned = [parse_part(part, description) for part in split(arguments)]
    first = replace(before, **planned[0].given)
    each = [replace(first, **one.given) for one in planned]
    of_all = {
        name: getattr(options, name)
        for name in OF_THE_CALL
        for options in each
        if getattr(options, name) != getattr(first, name)
    }
    return [replace(one, options=replace(options, **of_all)) for one, options in zip(planned, each)]


def parse_call(arguments: list[str], description: Description = NO_NAMES) -> list[Planned]:
    """The commands of a whole call of `moire`."""
    planned = parse(arguments, Options(port=description.port), description)
    for one in planned:
        if len(planned) > 1 and one.name in STANDS_ALONE:
            raise UsageError(f"'{one.name}' must be the only command of its call", one.name)
    return planned


def parse_line(text: str, options: Options, description: Description = NO_NAMES) -> list[Planned]:
    """The commands of one line of a file or of the shell, which have the options of the call."""
    try:
        arguments = shlex.split(text, comments=True)
    except ValueError as error:
        raise UsageError(f"'{text.strip()}' cannot be read: {error}") from None
    if not arguments:
        return []
    planned = parse(arguments, options, description)
    for one in planned:
        if one.name in STANDS_ALONE:
            raise UsageError(f"'{one.name}' is not allowed in a file or a shell", one.name)
        for name in OF_THE_PORT:
            if getattr(one.options, name) != getattr(options, name):
                option = name.replace("_", "-")
                raise UsageError(
                    f"--{option} holds for the whole call: give it to 'moire' itself", one.name
                )
    return planned
