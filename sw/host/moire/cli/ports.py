# SPDX-License-Identifier: Apache-2.0
"""Opens the port that the options name, and records what goes over it."""

from moire.bus import recording
from moire.bus.transport import Transport, open_bus
from moire.cli.options import Options
from moire.errors import BadFile, PortError


def name_of(options: Options) -> str:
    """The port of --port, of the variable MOIRE_PORT or of machine.toml; raises PortError."""
    port = options.port
    if not port:
        raise PortError(
            "no port: write --port /dev/ttyUSB0, or --port twin for the simulated stage; 'moire "
            "ports' lists them"
        )
    return port


def open_port(options: Options) -> Transport:
    """The transport of the port."""
    return open_bus(name_of(options), options.baud, options.parity)


def recorded(transport: Transport, file: str) -> Transport:
    """The transport, with everything on it written to a file, line by line, so that the file is
    complete up to the point where a call broke off.
    """
    try:
        opened = open(file, "w", encoding="utf-8", buffering=1)
    except OSError as error:
        transport.close()
        raise BadFile(f"the file {file} cannot be written: {error.strerror}") from None
    recorder = recording.Recorder(transport, opened)
    if recorder.failure is not None:  # even the first line
        recorder.close()  # raises it
    return recorder
