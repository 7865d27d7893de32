# SPDX-License-Identifier: Apache-2.0
"""Statements of Verilator's code: what they need and change, and where they can be moved to."""

import pytest

from twin import statements


def parsed(*lines, **words):
    return statements.Parser(lines, words).block()


def text_of(program):
    return [line for statement in program for line in statement.lines()]


def sunk(*lines, passing="xyz"):
    return text_of(statements.Sinker(frozenset(passing)).sunk(parsed(*lines)))


def test_what_only_one_branch_assigns_is_needed_from_before():
    (statement,) = parsed("if (a) {", "x = b;", "} else {", "y = c;", "}")
    assert statement.effect.needs == frozenset("abcxy") and not statement.effect.sets
    assert statement.effect.changes == frozenset("xy")


def test_what_both_branches_assign_is_set():
    (statement,) = parsed(
        "if (a) {", "x = b;", "} else if (c) {", "x = 0U;", "} else {", "x = d;", "}"
    )
    assert statement.effect.needs == frozenset("abcd") and statement.effect.sets == {"x"}


def test_a_part_of_a_signal_keeps_the_rest():
    (statement,) = parsed("x[a] = b;")
    assert statement.effect.needs == frozenset("abx") and not statement.effect.sets


def test_words_that_are_used_one_by_one_are_signals_of_their_own():
    first, second = parsed("x[1U] = a;", "b = x[1U];", x=3)
    assert first.effect.sets == {"x[1]"} and second.effect.needs == {"x[1]"}


def priority(times, source="(IData)(vlSelfRef.a)"):
    return " | ".join(f"({source} >> {n}U)" for n in range(times))


def test_an_expression_that_reads_one_signal_often_has_a_branch_for_zero():
    (statement,) = parsed(f"x = ({priority(statements.OFTEN)});")
    assert text_of([statement]) == [
        "if (0U != vlSelfRef.a) {",
        f"x = ({priority(statements.OFTEN)});",
        "} else {",
        f"x = ({priority(statements.OFTEN, '(IData)(0U)')});",
        "}",
    ]
    assert statement.effect == statements.Effect(frozenset("a"), frozenset("x"), frozenset("x"))


@pytest.mark.parametrize(
    "expression",
    [
        priority(statements.OFTEN - 1),
        f"{priority(statements.OFTEN)} | (IData)(b)",
        f"{priority(statements.OFTEN)} | a",  # of a width that is not known
    ],
)
def test_other_expressions_have_no_branch_for_zero(expression):
    assert text_of(parsed(f"x = ({expression});")) == [f"x = ({expression});"]


def test_a_loop_may_read_and_change_whatever_it_names():
    (statement,) = parsed("while ((a < b)) {", "x = a;", "}")
    assert statement.effect.needs == statement.effect.changes == frozenset("abx")


def test_a_block_that_does_not_end_is_refused():
    with pytest.raises(statements.FormError, match="does not end"):
        parsed("if (a) {", "x = b;")


def test_what_one_branch_needs_is_computed_in_it():
    assert sunk("x = a;", "if (b) {", "c = x;", "}") == ["if (b) {", "x = a;", "c = x;", "}"]


def test_what_several_branches_need_is_computed_in_each():
    assert sunk("x = a;", "if (b) {", "c = x;", "}", "if (d) {", "e = x;", "}") == [
        *("if (b) {", "x = a;", "c = x;", "}"),
        *("if (d) {", "x = a;", "e = x;", "}"),
    ]


def test_what_a_condition_needs_stays():
    lines = ["x = a;", "if (x) {", "c = x;", "}"]
    assert sunk(*lines) == lines


def test_nothing_goes_past_a_change_of_what_it_uses():
    lines = ["x = a;", "a = b;", "if (b) {", "c = x;", "}"]
    assert sunk(*lines) == lines


def test_a_signal_that_lasts_stays():
    lines = ["f = a;", "if (b) {", "c = f;", "}"]
    assert sunk(*lines) == lines


def test_a_value_and_its_exception_go_together():
    lines = ["x = a;", "if (b) {", "x = d;", "}", "if (c) {", "e = x;", "}"]
    assert sunk(*lines) == ["if (c) {", "x = a;", "if (b) {", "x = d;", "}", "e = x;", "}"]


def test_what_nobody_uses_is_left_out():
    assert sunk("x = a;", "x = b;", "c = x;") == ["x = b;", "c = x;"]


def test_the_other_statements_of_a_branch_stay():
    """They may be needed behind it."""
    lines = ["if (b) {", "y = d;", "c = x;", "}", "e = y;"]
    assert sunk("x = a;", *lines) == ["if (b) {", "x = a;", "y = d;", "c = x;", "}", "e = y;"]
