# SPDX-License-Identifier: Apache-2.0
"""One axis of a node: its drive, its motions, its correction and its signals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from math import inf
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

from moire import units
from moire.client import calibration, index_survey
from moire.client import stream as streams
from moire.client.access import COUNTS, FULL_SCALE
from moire.client.capture import AxisCapture
from moire.client.names import CAUSE_CODES, bit_names, code_name, descriptions, refusal
from moire.client.parameters import TRAVEL, AxisParameters
from moire.client.records import (
    CalibrationState,
    Correction,
    Drive,
    Encoder,
    IndexSurvey,
    Progress,
    Sample,
    Signal,
    Status,
)
from moire.client.values import CHOICES, whole
from moire.errors import (
    BusError,
    MoireError,
    MotionFailed,
    OutOfRange,
    PortError,
    Refused,
    UnitError,
    with_more,
)
from moire.made.bus_tables import (
    CALIBRATION_ACTIONS,
    CALIBRATION_REASONS,
    FAULTS,
    SIGNAL_FAULTS,
    STREAM_LATEST,
)

if TYPE_CHECKING:
    from moire.client.node import Node

MOST_BACKLASH = (1 << 24) - 1  # counts
HYSTERESIS = COUNTS >> 8  # counts, of its reversals
HARMONICS = 10  # orders of phase error that are corrected
REACT_S = 0.3  # that a program needs to notice that its motion was stopped, and to end
SCATTER = 1 << 20  # counts of the calibration's scatter in one signal period
PROGRESS_S = 0.02  # a stream reports its progress only while its queue lasts longer
OUTPUTS = ("bridge", "stepper", "dac", "fine_stage")  # in the order of the parameter drive
CORRECTION = ("sin_offset", "cos_offset", "gain", "quadrature_error")

Result = TypeVar("Result")


class Axis(AxisParameters, AxisCapture):
    """One axis of a node. Bus.axis() or Node.axis() makes it.

    As a context manager it stops a motion that is under way at the end of the block, and switches
    the drive off if it was off at the beginning.
    """

    def __init__(self, node: Node, number: int):
        super().__init__(node, number)
        self.override_before_pause: Fraction | None = None
        self.was_enabled: list[bool] = []  # at the beginning of each block that is open

    def __enter__(self) -> Self:
        self.was_enabled.append(self.status().enabled)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        was_enabled = self.was_enabled.pop()
        try:
            try:
                if self.status().in_motion:
                    self.stop_and_wait()
            finally:
                if not was_enabled:
                    self.disable()
        except MoireError:
            if error is None:  # otherwise that one explains more
                raise

    # drive

    @contextmanager
    def enabled(self) -> Iterator[Self]:
        """A block in which the drive is on; raises Refused while a fault is latched.

        At its end a motion that is under way is stopped, and the drive is switched off if it was
        off before.
        """
        with self:
            if not self.status().enabled:
                self.enable()
            yield self

    def enable(self) -> None:
        """Switches the drive on; raises Refused while a fault is latched."""
        self.request("enable", on=1)
        self.node.switched_on.add(self.number)

    def enable_for(self, motion: str) -> None:
        """Switches the drive on for a "move", "prepare" or "begin_stream". An axis without a zero
        is refused in the words of the node, and its drive stays off.
        """
        status = self.status()
        can_be_on = not status.faults and self.built().has("drive")  # else the node says why
        if not status.homed and can_be_on:
            raise refusal(self.node.address, motion, CAUSE_CODES["not_homed"])
        self.enable()

    def disable(self) -> None:
        """Switches the drive off at once, without a stop."""
        self.request("enable", on=0)
        self.node.switched_on.discard(self.number)

    def reset(self) -> None:
        """Clears latched faults whose cause is gone. The drive stays off."""
        self.request("reset_faults")

    def set_backlash(
        self,
        backlash: units.Value,
        velocity: units.Value,
        hysteresis: units.Value,
        motor_side: bool = False,
    ) -> None:
        """Sets how far the motor moves after a reversal until the table moves (nm, or a text), and
        the velocity beyond that of the target (mm/s, or a text) with which it does so.

        hysteresis: how far the target must come back until that is a reversal (nm, or a text).
        motor_side: the sensor is on the motor's side of the backlash, which it must be in an axis
        without a stepper. It is valid until the node has no power. Raises OutOfRange, or Refused
        `not_built` without HAS_BACKLASH.
        """
        counts = self.to_counts(backlash)
        ticks = self.node.identity.tick_hz
        rate = round(units.parse_speed(velocity) * 1_000_000 / self.period_nm * COUNTS / ticks)
        back = self.to_counts(hysteresis) // HYSTERESIS
        if not 0 <= counts <= MOST_BACKLASH or not 0 < rate <= MOST_BACKLASH or not 0 <= back < 128:
            most, half = (
                units.format_length(most * self.period_nm / COUNTS)
                for most in (MOST_BACKLASH, 127 * HYSTERESIS)
            )
            raise OutOfRange(
                f"backlash {backlash} with {velocity} and hysteresis {hysteresis}: the backlash "
                f"must be 0 to {most}, the velocity above 0 and at most that in each servo tick, "
                f"the hysteresis 0 to {half}"
            )
        if counts and not motor_side and not self.built().has("stepper"):
            raise OutOfRange(
                f"axis {self.number} of node {self.node.address} has no stepper: with its sensor "
                "on the table a servo takes the backlash up itself; motor_side is for one on the "
                "motor"
            )
        self.node.write_named(  # before the backlash, which would else be taken up at once
            "feedback.backlash_rate",
            self.number,
            value=rate,
            hysteresis=back,
            motor_side=int(motor_side),
        )
        self.node.write_named("feedback.backlash", self.number, value=counts)

    def drive(self) -> Drive:
        """Which output the drive command goes to, and its present value."""
        drive, steps, fine = (
            self.node.read_named(f"actuator.{name}", self.number)
            for name in ("drive", "steps", "fine_command")
        )
        kinds, built = CHOICES["drive"], self.built()
        return Drive(
            kind=kinds[drive["value"]],
            built=tuple(
                name
                for name, feature in zip((*kinds, "fine"), OUTPUTS, strict=True)
                if built.has(feature)
            ),
            command=self.status().drive_command,
            steps=steps["value"],
            fine_command=fine["value"] / FULL_SCALE,
            override=self.override(),
        )

    # motion

    def home(self, progress: Progress | None = None, method: str | int | None = None) -> Status:
        """Finds the zero of the axis; returns when it is reached.

        `method` is a number of CiA 402, "s0" or "s3", and is stored in the parameter home_method;
        without it that parameter holds. `progress` is called with a Status from time to time.
        Raises Refused or MotionFailed.
        """
        if method is not None:
            self.set_parameter("home_method", method)
        return self.motion("home", progress)

    def move(
        self,
        target: str | None = None,
        *,
        nm: units.Number | None = None,
        um: units.Number | None = None,
        mm: units.Number | None = None,
        by: bool = False,
        progress: Progress | None = None,
    ) -> Status:
        """Moves to a position; returns when the axis has settled there.

        The target is a text with a unit such as "1.5mm", or a number with the name of its unit:
        mm=1.5. With `by` it is a distance from the present target. `progress` is called with a
        Status from time to time. Raises UnitError, OutOfRange, Refused or MotionFailed. Whatever
        interrupts the wait, Ctrl-C too, stops the axis under control first.
        """
        length = length_of("move", target, nm, um, mm)
        return self.to_target(length, by, lambda at: self.motion("move", progress, target=at))

    def begin_move(
        self,
        target: str | None = None,
        *,
        nm: units.Number | None = None,
        um: units.Number | None = None,
        mm: units.Number | None = None,
        by: bool = False,
    ) -> float:
        """Begins the motion of move(), and returns at once.

        Returns the seconds that the motion takes at full speed. See wait(), pause() and stop().
        """
        length = length_of("move", target, nm, um, mm)
        return self.to_target(length, by, lambda at: self.duration_s("move", at))

    def prepare(
        self,
        target: str | None = None,
        *,
        nm: units.Number | None = None,
        um: units.Number | None = None,
        mm: units.Number | None = None,
        by: bool = False,
    ) -> float:
        """Plans the motion of move(), which then waits for Node.start() or Bus.start().

        Returns the seconds that the motion takes at full speed.
        """
        length = length_of("prepare", target, nm, um, mm)
        return self.to_target(length, by, lambda at: self.duration_s("prepare", at))

    def stream(
        self,
        points: Iterable[streams.Point],
        late_limit: units.Value = "10ms",
        progress: Progress | None = None,
    ) -> Status:
        """Plays a path of points (time, position, velocity); returns when the axis has settled at
        its end.

        The axis first moves to the first point, where the path begins at rest. `late_limit` (s, or
        a text) is how long the node may continue at constant velocity when the next point has not
        come in time; then it stops under control. `progress` is called with a Status from time to
        time. The whole path is checked before anything moves. Raises OutOfRange, Refused or
        MotionFailed. Whatever interrupts the wait, Ctrl-C too, stops the axis under control.
        """
        path = streams.checked(points)
        self.require_streams()
        tick_hz = self.node.identity.tick_hz
        late_ticks = round(units.parse_time(late_limit) * tick_hz)
        if not 0 <= late_ticks <= STREAM_LATEST:
            given = units.format_time(units.parse_time(late_limit))
            most = units.format_time(Fraction(STREAM_LATEST, tick_hz))
            raise OutOfRange(f"the late limit is {given}; allowed is 0 to {most}")
        streams.check_limits(path, self.stream_limits())
        wire = streams.set_points(path, self.period_nm, tick_hz)
        begin = path[0].position_nm

        def carry_out() -> Status:
            status = self.status()
            if self.to_counts(Fraction(status.target_nm)) != self.to_counts(begin):
                self.to_target(begin, False, lambda at: self.motion("move", progress, target=at))
            self.request("begin_stream", late_limit=late_ticks)
            self.feed(wire, progress)
            return self.wait(progress)

        return self.stopping_on_error(carry_out)

    def require_streams(self) -> None:
        """Raises Refused, with what to do, if the firmware of the node plays no streams."""
        try:
            self.request("stream")
        except Refused as refused:
            if refused.cause == "not_built":
                raise with_more(refused, streams.REMEDY) from None
            raise

    def stream_limits(self) -> streams.Limits:
        """The limits that hold for a stream."""
        velocity, acceleration = (
            self.get_parameter(name).value for name in ("velocity", "acceleration")
        )
        return streams.Limits(velocity, acceleration)

    def feed(self, wire: Sequence[streams.SetPoint], progress: Progress | None) -> None:
        """Sends the set-points of a stream, as the queue has room; starts it when that is full."""
        sent = self.fill(wire, 0, 1)
        self.node.request("start", axes=1 << self.number)
        while sent < len(wire):
            sent = self.fill(wire, sent, self.room_of_stream(progress))

    def fill(self, wire: Sequence[streams.SetPoint], sent: int, room: int) -> int:
        """Sends set-points while the queue has room, from the one after the first `sent` on;
        returns how many are sent then.
        """
        while room and sent < len(wire):
            room = self.send(wire[sent], last=sent == len(wire) - 1)
            sent += 1
        return sent

    def send(self, set_point: streams.SetPoint, last: bool) -> int:
        """Sends a set-point; returns for how many more the queue has room. A refusal ends the
        stream: then the axis stops, and the error names how, or the point.
        """
        try:
            return self.request(
                "set_point",
                last=int(last),
                tick=set_point.tick,
                position=set_point.position,
                velocity=set_point.velocity,
            )["room"]
        except Refused as refused:
            if refused.cause == "no_stream":
                self.wait()  # raises how it ended
            self.stop_and_wait()
            raise with_more(refused, streams.named(set_point.point)) from None

    def room_of_stream(self, progress: Progress | None) -> int:
        """Lets half of the time pass that the queue lasts, or less; returns its room. Raises
        MotionFailed if the stream has ended.
        """
        queue = self.request("stream")
        if not queue["open"]:
            self.wait(progress)
        if queue["room"] == 0:
            seconds = queue["queued"] / self.node.identity.tick_hz / 2
            if progress is not None and seconds > PROGRESS_S:
                progress(self.status())
            self.node.bus.until_next_poll(self.node, min(self.node.bus.poll_s, seconds))
        return queue["room"]

    def duration_s(self, operation: str, target: int) -> float:
        """Requests a motion to a target in counts; returns its duration in seconds."""
        ticks = self.request(operation, target=target)["duration_ticks"]
        return ticks / self.node.identity.tick_hz

    def to_target(self, nm: Fraction, by: bool, begin: Callable[[int], Result]) -> Result:
        """Calls `begin` with the target in counts; a refusal of the target names the travel."""
        target_nm = Fraction(self.status().target_nm) + nm if by else nm
        try:
            return begin(self.to_counts(target_nm))
        except Refused as refused:
            if refused.cause == "out_of_travel":
                low, high = (self.get_parameter(name).written(9) for name in TRAVEL)
                raise with_more(
                    refused, f"target {units.format_length(target_nm)}, allowed {low} to {high}"
                ) from None
            raise

    def motion(self, operation: str, progress: Progress | None, **fields: int) -> Status:
        """Requests a motion and waits for its end; stops the axis when the wait is interrupted."""

        def carry_out() -> Status:
            self.request(operation, **fields)
            return self.wait(progress)

        return self.stopping_on_error(carry_out)

    def motion_end(self, progress: Progress | None = None) -> Status:
        """Waits for the end of the motion that is under way, like move()."""
        return self.stopping_on_error(lambda: self.wait(progress))

    def stopping_on_error(self, work: Callable[[], Result]) -> Result:
        """Calls `work`, and stops the axis under control if something interrupts it.

        Errors of the bus or of the motion itself do not: the node handles these.
        """
        try:
            return work()
        except (BusError, Refused, MotionFailed):
            raise
        except BaseException:
            self.stop_and_wait()
            raise

    def wait(self, progress: Progress | None = None) -> Status:
        """Waits for the end of the motion; raises MotionFailed unless it reached its target."""
        while True:
            status = self.status()
            if progress is not None:
                progress(status)
            if status.ended != "running":
                break
            self.node.bus.until_next_poll(self.node)
        return self.reached(status)

    def reached(self, status: Status) -> Status:
        """The status at the end of a motion; raises MotionFailed unless it reached its target."""
        if status.ended in ("ok", "no_motion_yet"):
            return status
        sentence = f"axis {self.number} of node {self.node.address}: {status.ended_words}"
        if status.ended == "ended_by_fault":
            sentence += f": {descriptions(FAULTS, status.first_fault or status.faults)}"
        sentence += f" (at {units.format_length(status.position_nm)}"
        if status.ended == "not_settled":  # after a stop or a fault the target is the position
            sentence += f", target {units.format_length(status.target_nm)}"
        sentence += ")"
        raise MotionFailed(status.ended, CAUSE_CODES.get(status.ended, -1), sentence)

    def dwell(self, seconds: float, progress: Progress | None = None) -> Status:
        """Waits this long, with requests often enough for the watchdog."""
        end = self.transport.now() + seconds
        while True:
            status = self.status()
            if progress is not None:
                progress(status)
            left = end - self.transport.now()
            if left <= 0:
                return status
            self.node.bus.until_next_poll(self.node, min(self.node.bus.poll_s, left))

    def samples(
        self, every: units.Value = "20ms", duration: units.Value | None = None
    ) -> Iterator[Sample]:
        """The status of the axis every so often, in the time of its bus: for a duration, or as long
        as anybody takes them. Both are texts with a unit, or numbers in s.

        The first sample comes at once. Between samples the axis hears requests often enough for its
        watchdog, so a drive stays on while they are taken.
        """
        step_s, now = float(units.parse_time(every)), self.transport.now
        shown = now()
        end = inf if duration is None else shown + float(units.parse_time(duration))
        while True:
            status = self.status()
            if now() >= shown:
                shown = max(shown + step_s, now())
                yield Sample(now(), status)
            if now() >= end:
                return
            left = max(0.0, min(shown, end) - now())
            self.node.bus.until_next_poll(self.node, min(self.node.bus.poll_s, left))

    def stop(self) -> None:
        """Begins a controlled stop; the drive stays on. It does not wait: see wait()."""
        self.request("stop")

    def stop_and_wait(self) -> None:
        """Stops under control and waits until the axis is at rest; not an error if it is off."""
        try:
            self.stop()
            while self.status().in_motion:
                self.node.bus.until_next_poll(self.node)
        except Refused:
            pass  # the drive is off
        except (BusError, PortError) as error:
            error.args = (
                f"axis {self.number} of node {self.node.address} could not be stopped by the host, "
                f"its watchdog has to: {error}",
            )
            raise error from None

    def take_over(self) -> None:
        """Stops a motion that another client of the bus began. Returns when the other one has had
        time to switch off what it had switched on.
        """
        if self.status().in_motion:
            self.stop_and_wait()
            self.dwell(REACT_S)

    def stop_if_enabled(self) -> None:
        """Like stop_and_wait(), but drops errors: one of several axes must not keep the others."""
        try:
            self.stop_and_wait()
        except MoireError:
            pass

    def override(self, fraction: units.Value | None = None) -> Fraction:
        """The speed at which profiles are played, as a fraction of full speed.

        Given a fraction ("50%" or 0.5), it changes that speed, also during a motion.
        """
        if fraction is None:
            return self.get_parameter("feed_override").value
        self.override_before_pause = None
        return self.set_parameter("feed_override", units.parse_share(fraction)).value

    def pause(self) -> None:
        """Halts the motion within its limits of acceleration; resume() continues it."""
        before = self.override()
        if before:
            self.override(0)
            self.override_before_pause = before

    def resume(self) -> Fraction:
        """Continues with the override before pause(); at full speed if another host paused."""
        return self.override(self.override_before_pause or 1)

    # index

    def survey_index(
        self, progress: Callable[[str], object] | None = None, passes: int = index_survey.PASSES
    ) -> IndexSurvey:
        """Measures where the index lies between the edges of A and B, sets the parameter
        index_gate to the levels of A and B that keep clear of its edges, and homes the axis.

        The axis must be enabled, and home_method must search the index. It is homed first, and then
        passes the index in the direction of the search, `passes` times over each of its edges.
        `progress` is called with what is done next. Raises NotSurveyed, Refused or MotionFailed;
        index_gate is then unchanged. A result with warnings has no gate that is safe.
        """
        if passes < 2:
            raise OutOfRange(f"a survey makes at least 2 passes over each edge, not {passes}")
        survey = index_survey.Survey(self, passes, progress)
        return self.stopping_on_error(survey.run)

    # correction of sine and cosine

    def calibration(self, action: str = "read") -> CalibrationState:
        """The state of the auto-calibration, after "calibrate", "freeze" or "clear" if given."""
        actions = {name: code for code, (name, _) in CALIBRATION_ACTIONS.items()}
        if action not in actions:
            raise OutOfRange(
                f"the calibration has no action '{action}': allowed are {', '.join(actions)}"
            )
        reply = self.request("calibration", action=actions[action])
        return CalibrationState(
            reason=code_name(CALIBRATION_REASONS, reply["reason"], "reason"),
            settled=bool(reply["converged"]),
            frozen=bool(reply["frozen"]),
            accepted=reply["accepted"],
            refused=reply["refused"],
            scatter_nm=float(reply["scatter"] * self.period_nm / SCATTER),
        )

    def calibrate(
        self,
        progress: Callable[[CalibrationState], object] | None = None,
        distance: units.Value = "1mm",
        timeout: units.Value = "120s",
    ) -> CalibrationState:
        """Calibrates the correction from scratch, then freezes it.

        The axis must be enabled and homed. It moves over `distance` (nm, or a text) at several
        speeds, to the side where the travel has room, until the correction is settled, and comes
        back. A longer distance allows a higher speed, and the sine periods must pass faster than
        the stage can follow or ring. `progress` is called with a CalibrationState after each
        stroke. Raises NotCalibrated with the reason if it is not settled after `timeout` (s, or a
        text). The parameter `velocity` has its old value afterwards.
        """
        return calibration.calibrate(self, progress, distance, timeout)

    def correction(self) -> Correction:
        """The correction in force, in counts, ready for a JSON file."""
        reply = self.request("get_correction")
        harmonics = [self.request("get_harmonic", order=order) for order in range(1, HARMONICS + 1)]
        return Correction(
            sin_offset=reply["sin_offset"],
            cos_offset=reply["cos_offset"],
            gain=reply["gain"],
            quadrature_error=reply["quadrature_error"],
            cosine=[harmonic["cosine"] for harmonic in harmonics],
            sine=[harmonic["sine"] for harmonic in harmonics],
        )

    def set_correction(self, values: Mapping[str, Any]) -> None:
        """Sets a correction as correction() returns it, at once and as a whole.

        Raises OutOfRange, and changes nothing, when it is not complete.
        """
        cosine, sine = values.get("cosine"), values.get("sine")
        complete = all(whole(values.get(name)) for name in CORRECTION) and all(
            isinstance(terms, list) and len(terms) == HARMONICS and all(map(whole, terms))
            for terms in (cosine, sine)
        )
        if not complete or cosine is None or sine is None:
            raise OutOfRange(
                f"this is no correction: it has the whole numbers {', '.join(CORRECTION)} and the "
                f"lists cosine and sine of {HARMONICS} whole numbers each"
            )
        for order, (cosine_term, sine_term) in enumerate(zip(cosine, sine, strict=True), 1):
            self.request("set_harmonic", order=order, cosine=cosine_term, sine=sine_term)
        self.request("set_correction", **{name: values[name] for name in CORRECTION}, apply=1)

    # encoder

    def encoder(self) -> Encoder:
        """The raw signals of the encoder, and what homing found."""
        reply = self.request("encoder")
        return Encoder(
            sin=reply["sin"],
            cos=reply["cos"],
            phase=reply["phase"] / COUNTS,
            amplitude=reply["amplitude"],
            quadrature_count=reply["quadrature_count"],
            rejected_pulses=reply["rejected_pulses"],
            rejected_samples=reply["rejected_samples"],
            home_phase_nm=self.to_nm(reply["home_phase"]),
            home_margin=1 - abs(reply["home_phase"]) / (COUNTS / 2),
            fault_position_nm=self.to_nm(reply["fault_position"]),
        )

    def has_sine(self) -> bool:
        """Whether this axis was built with sine and cosine.

        Without them the position is made of counts, and the node refuses what needs them.
        """
        return self.built().has("sine")

    def signal(self) -> Signal:
        """What is wrong with sine and cosine."""
        reply = self.request("signal")
        return Signal(
            bit_names(SIGNAL_FAULTS, reply["faults"]), bit_names(SIGNAL_FAULTS, reply["first"])
        )


def length_of(
    operation: str,
    text: str | None,
    nm: units.Number | None,
    um: units.Number | None,
    mm: units.Number | None,
) -> Fraction:
    """The one length that is given, in nm; raises UnitError or OutOfRange."""
    if text is not None and not isinstance(text, str):
        raise UnitError(
            f"a {operation} to {text!r} has no unit: write mm={text!r}, um={text!r} or "
            f"nm={text!r}, or a text such as '1.5mm'"
        )
    numbers = {"nm": nm, "um": um, "mm": mm}
    given = {unit: number for unit, number in numbers.items() if number is not None}
    if len(given) + (text is not None) != 1:
        raise OutOfRange(f"a {operation} needs one target: a text such as '1.5mm', mm=, um= or nm=")
    if text is not None:
        return units.parse_length(text)
    [(unit, number)] = given.items()
    try:
        return Fraction(number) * units.LENGTHS[unit]
    except (TypeError, ValueError, OverflowError):
        raise OutOfRange(f"{unit}={number!r} is no length: give a finite number") from None
