# SPDX-License-Identifier: Apache-2.0
"""What a campaign is: a long test that is divided into parts, each with a seed of its own.

A module of sw/figures that has a long test has a dictionary CAMPAIGNS = {name: Campaign}; it is
found by name and needs no registration:

    CAMPAIGNS = {
        "decoder": Campaign(
            "edges of an encoder with jitter, glitches and reversals",
            lambda part, seed: encoder_run(SHARE, seed),     # {"edges": 1000000, "wrong": 0, …}
            parts=1000,
            tried="edges",
            failed="wrong",
        )
    }

The function runs on any machine of a cluster, in any order, and possibly more than once; so it
depends on nothing but its arguments and the content of the repository.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, expm1, lgamma, log, log1p

SEEDS_APART = 10**6  # more than any campaign or figure has runs
CONFIDENCE = 0.95
BEYOND = 40  # terms of a sum that are smaller than e^-40 of its largest one do not matter

# Numbers are added up over all parts. Words are findings: the page shows them beside the part.
Counts = Mapping[str, float | str]


def seeds(seed: int, count: int) -> range:
    """Seeds of so many runs: 1, 2, 3 … for the seed 1, and others for every other seed."""
    first = (seed - 1) * SEEDS_APART + 1
    return range(first, first + count)


@dataclass(frozen=True)
class Campaign:
    """`what` says in a few words what is tried and how it is judged; it completes "10^9 …".

    `tried` names the count of trials, `failed` the count of those that failed, and `largest` the
    counts of which the campaign reports the largest, not the sum. A campaign is good if at most
    the share `allowed` of its trials failed.
    """

    what: str
    run: Callable[[int, int], Counts]  # (part, its seed)
    parts: int
    tried: str
    failed: str
    largest: tuple[str, ...] = ()
    allowed: float = 0.0

    def parts_of(self, scale: float) -> int:
        """Number of parts of this share of the campaign, one at least."""
        return max(1, round(self.parts * scale))


@dataclass(frozen=True)
class Task:
    """One part of a campaign, identified by what its result depends on."""

    campaign: str
    version: str
    seed: int  # of the campaign, 1 and up
    part: int

    @property
    def part_seed(self) -> int:
        return seeds(self.seed, self.part + 1)[-1]

    @property
    def name(self) -> str:
        """Identifies the task in the whole cluster."""
        return f"{self.campaign}-{self.version}-seed{self.seed}-part{self.part}"

    @property
    def command(self) -> str:
        """The command that runs this part again."""
        return f"make soak K={self.campaign} SEED={self.seed} PART={self.part}"


@dataclass(frozen=True)
class Result:
    """What one part yielded, where and when."""

    task: Task
    counts: Counts
    host: str
    began: str  # UTC
    seconds: float


def added(campaign: Campaign, results: Mapping[int, Result]) -> dict[str, float]:
    """The counts of several parts as one."""
    total = {campaign.tried: 0.0, campaign.failed: 0.0}
    for part in sorted(results):
        for name, value in results[part].counts.items():
            if isinstance(value, str):
                continue
            if name in campaign.largest:
                total[name] = max(total.get(name, value), value)
            else:
                total[name] = total.get(name, 0) + value
    return total


def log_chance(failed: int, tried: int, share: float) -> float:
    """Logarithm of the chance of exactly so many failures, each trial failing with this share."""
    ways = lgamma(tried + 1) - lgamma(failed + 1) - lgamma(tried - failed + 1)
    return ways + failed * log(share) + (tried - failed) * log1p(-share)


def chance_of_at_most(failed: int, tried: int, share: float) -> float:
    """Chance of at most so many failures; `share` is above failed / tried, so that the last term
    of the sum is its largest one."""
    whole, last = 0.0, log_chance(failed, tried, share)
    for number in range(failed, -1, -1):
        term = log_chance(number, tried, share)
        whole += exp(term)
        if term < last - BEYOND:
            break
    return min(1.0, whole)


def upper_bound(failed: int, tried: int, confidence: float = CONFIDENCE) -> float:
    """The largest share of failures that is compatible with the counts (Clopper-Pearson, one
    side). Without a failure in n trials this is the rule of three, 3 / n for 95 %.

    It supposes that the trials are independent and drawn as those of the future will be.
    """
    if tried <= 0 or failed >= tried:
        return 1.0
    if failed == 0:
        return -expm1(log1p(-confidence) / tried)
    low, high = failed / tried, 1.0
    for _ in range(200):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        if chance_of_at_most(failed, tried, middle) > 1 - confidence:
            low = middle
        else:
            high = middle
    return high
