# SPDX-License-Identifier: Apache-2.0
"""The page of a campaign: counts, seeds, version, and what they prove."""

from collections.abc import Sequence

from campaigns.campaign import CONFIDENCE, added, upper_bound
from campaigns.runner import Job
from experiments.report_page import text_of
from moire.analysis import report

Row = Sequence[report.Cell]


def whole(number: float) -> str:
    """Without digits after the point where there are none."""
    return f"{number:,.0f}".replace(",", " ") if number == int(number) else f"{number:.6g}"


def bound_words(tried: float, failed: float) -> str:
    return f"{upper_bound(int(failed), int(tried)):.2g}"


def is_bad(job: Job) -> bool:
    """Whether a part could not be done, or too many trials of those that are done failed."""
    total = added(job.campaign, job.results)
    share = total[job.campaign.failed] / max(1, total[job.campaign.tried])
    return bool(job.failures) or share > job.campaign.allowed


def is_good(job: Job) -> bool:
    """Whether all parts that were asked for are done, and few enough trials failed."""
    return not job.waiting and not is_bad(job)


def sentence(job: Job) -> str:
    """What the campaign has shown so far, in one sentence."""
    campaign, total = job.campaign, added(job.campaign, job.results)
    tried, failed = total[campaign.tried], total[campaign.failed]
    if not tried:
        return "no part is done yet"
    words = f"{whole(failed)} {campaign.failed} in {whole(tried)} {campaign.tried}"
    return f"{words}: a share below {bound_words(tried, failed)} with {CONFIDENCE:.0%} confidence"


def parts_words(parts: Sequence[int]) -> str:
    """`0–4, 7`"""
    runs: list[list[int]] = []
    for part in sorted(parts):
        if runs and part == runs[-1][1] + 1:
            runs[-1][1] = part
        else:
            runs.append([part, part])
    return ", ".join(f"{a}" if a == b else f"{a}\N{EN DASH}{b}" for a, b in runs) or "none"


def bad_rows(job: Job) -> list[Row]:
    rows: list[Row] = []
    for part, result in sorted(job.bad.items()):
        found = [f"{n}: {v}" for n, v in result.counts.items() if isinstance(v, str)]
        count = whole(float(result.counts[job.campaign.failed]))
        words = "; ".join([f"{count} {job.campaign.failed}", *found])
        rows.append((str(part), str(result.task.part_seed), words, result.task.command))
    for part, failure in sorted(job.failures.items()):
        task = failure.task
        rows.append((str(part), str(task.part_seed), f"not done: {failure.reason}", task.command))
    return rows


def page(job: Job) -> str:
    """The whole page, as HTML."""
    campaign, total = job.campaign, added(job.campaign, job.results)
    tried, failed = total[campaign.tried], total[campaign.failed]
    done = sorted(job.results)
    seconds = sum(result.seconds for result in job.results.values())
    times = sorted(result.began for result in job.results.values())
    counts = [(name, whole(value)) for name, value in total.items()]
    tables = [report.table(("count", "largest or sum of all parts"), counts, text_columns=1)]
    if bad := bad_rows(job):
        head = ("part", "seed", "what went wrong", "the same again")
        tables.append(report.table(head, bad, text_columns=4))
    seeds = [job.task(part).part_seed for part in done]
    verdict = "Not good" if is_bad(job) else "Not complete" if job.waiting else "Good"
    return text_of(
        f"Campaign {job.name}",
        f"{verdict}. {campaign.what[:1].upper()}{campaign.what[1:]}.",
        tables,
        {
            "result": sentence(job),
            "confidence": "Clopper-Pearson, one side; without a failure in n trials this is 3 / n. "
            "It supposes independent trials, drawn as those of the machine will be",
            "allowed share of failures": f"{campaign.allowed:g}",
            "version": f"{job.version} (commit, content)",
            "seed of the campaign": str(job.seed),
            "seeds of the parts": parts_words(seeds),
            "parts done": f"{len(done)} of the {job.parts} asked for; the whole campaign has "
            f"{campaign.parts}",
            "parts not done": parts_words([task.part for task in job.waiting]),
            "time of cores": f"{seconds / 3600:.2f} h",
            "begun, last part begun": f"{times[0]}, {times[-1]}" if times else "not yet",
            "again": f"make soak K={job.name} SEED={job.seed}",
        },
        [
            (whole(tried), campaign.tried),
            (whole(failed), campaign.failed),
            (f"< {bound_words(tried, failed)}", f"share of failures, {CONFIDENCE:.0%} confidence"),
        ],
    )
