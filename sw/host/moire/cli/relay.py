# SPDX-License-Identifier: Apache-2.0
"""The commands `moire relay …`: status, calibrate from a table of readings, clear flags. The
command line adds them to its parser:

add_to(group, command)
"""

from pathlib import Path

from moire.analysis import report
from moire.client.relay import Relay, Settings, make_set, terms_of
from moire.errors import BadFile


def add_to(group, command):
    """group: the sub-parsers of `relay`; command(name, handler, text, example, under): makes one of
    them.
    """
    command(
        "status",
        do_status,
        "what the relay does, and its flags",
        "moire --port /dev/ttyUSB0 relay status",
        group,
    )
    command("clear", do_clear, "let all flags fall", "moire --port /dev/ttyUSB0 relay clear", group)
    calibrate = command(
        "calibrate",
        do_calibrate,
        "fit a table of readings, write it to the relay, keep it in flash",
        "moire --port /dev/ttyUSB0 relay calibrate ring.csv --counts 32768 --picture ring.png",
        group,
    )
    calibrate.add_argument(
        "file",
        metavar="FILE",
        help="CSV: angle in degrees, error (encoder minus reference) in arcsec",
    )
    calibrate.add_argument(
        "--counts", type=int, required=True, metavar="N", help="counts per turn, four per line"
    )
    calibrate.add_argument(
        "--orders", type=int, metavar="K", help="as many as readings and relay carry unless given"
    )
    calibrate.add_argument(
        "--noise", type=float, metavar="ARCSEC", help="rms of one reading; estimated unless given"
    )
    calibrate.add_argument(
        "--index-at",
        type=float,
        default=0.0,
        metavar="DEGREES",
        help="angle of the table at the index; 0 unless given",
    )
    calibrate.add_argument("--picture", metavar="FILE", help="before and after, as PNG")
    calibrate.add_argument(
        "--dry", action="store_true", help="fit and draw only, write nothing to the relay"
    )
    calibrate.add_argument(
        "--no-flash", action="store_true", help="in force now, but not kept for the next power-up"
    )


def relay_of(session):
    return Relay(session.bus.transport)


def told(status):
    return {**status._asdict(), "identity": f"{status.identity:08X}"}


def do_status(session, options):
    status = relay_of(session).status()
    session.say(told(status), status.words())


def do_clear(session, options):
    status = relay_of(session).clear()
    session.say(told(status), status.words())


def do_calibrate(session, options):
    from moire.analysis.harmonic_fit import fit, read_readings

    readings = read_readings(options.file)
    relay = None if options.dry else relay_of(session)
    orders = options.orders
    if orders is None and relay:
        orders = min(readings.most_orders, relay.status().orders)
    found = fit(readings, orders=orders, noise=options.noise)
    if options.picture:
        save(options.picture, picture(readings, found))
    if relay:
        whole = make_set(
            terms_of(found, options.counts, options.index_at),
            Settings(options.counts),
            relay.status().orders,
        )
        relay.write(whole)
        if not options.no_flash:
            relay.save(whole)
    written = (
        "nothing written"
        if options.dry
        else "in force"
        if options.no_flash
        else "in force, and kept in flash"
    )
    session.say(
        {
            "orders": found.orders,
            "before": found.before,
            "left": found.left,
            "noise": found.noise,
            "written": written,
        },
        f"{found.words()}\n{written}",
    )


def picture(readings, found) -> bytes:
    """Readings before and after, and the curve that is taken off."""
    figure, (whole, fine) = report.drawing(height=6.0, nrows=2, sharex=True)
    fine_angle = [
        readings.angle[0] + n * 0.5
        for n in range(int(2 * (readings.angle[-1] - readings.angle[0])) + 1)
    ]
    whole.plot(
        fine_angle, found.at(fine_angle), color=report.colour(0), linewidth=1.2, label="correction"
    )
    whole.plot(
        readings.angle,
        readings.error - found.constant,
        linestyle="",
        marker="o",
        markersize=3.5,
        color="#555555",
        label="readings",
    )
    fine.plot(
        readings.angle,
        readings.error - found.constant - found.at(readings.angle),
        linestyle="",
        marker="o",
        markersize=3.5,
        color=report.colour(1),
        label="left",
    )
    fine.set_xlabel("angle / degrees")
    for panel in (whole, fine):
        panel.set_ylabel("error / arcsec")
    report.legend(figure, whole)
    return report.png(figure)


def save(path, image):
    try:
        Path(path).write_bytes(image)
    except OSError as error:
        raise BadFile(f"{path} cannot be written: {error.strerror}") from None
