# SPDX-License-Identifier: Apache-2.0
"""The machines of the experiments for any client: `moire twin --machine s2`, `moire --port
twin:s2`.

Each machine is powered up and has the parameters of its experiment. The names are the same as in
moire.bus.twin_port.
"""

from collections.abc import Callable
from typing import Any

from experiments import s0_fine, s2_stage, s3_zero, s4_job
from experiments.s0_stage import ADDRESSES
from moire.errors import TwinNotBuilt
from twin import WITH_SCOPE, BuildError, Twin, TwinTransport


def fine_stage(seed: int) -> Twin:
    """The X axis with its piezo, the fine stage switched on."""
    stage = s0_fine.FineStage.power_up(seed)
    stage.switch_fine_on("X")
    return stage.twin


def stage(seed: int, nodes: tuple[int, ...] = tuple(ADDRESSES.values())) -> Twin:
    """The stage of S0 with segment table, filters and recorder of ticks; its nodes listen."""
    twin = Twin(nodes=nodes, seed=seed, node_parameters=WITH_SCOPE)
    twin.run_until_ready()
    return twin


MACHINES: dict[str, Callable[..., Twin]] = {
    "s0": stage,
    "s0_fine": fine_stage,
    "s2": lambda seed: s2_stage.Stage.power_up(seed).twin,
    "s3": lambda seed: s3_zero.Motor(seed).twin,
    "s4": lambda seed: s4_job.IndexingMachine(seed).twin,
}


def open_port(machine: str, seed: int, **settings: Any) -> TwinTransport:
    """The port `twin:MACHINE` of the host package (entry point of the group moire.ports).

    Raises TwinNotBuilt if the machine cannot be built.
    """
    try:
        return TwinTransport(MACHINES[machine](seed, **settings))
    except (BuildError, OSError) as error:
        raise TwinNotBuilt(
            f"the simulated machine cannot be built: {str(error).strip().splitlines()[-1]}"
        ) from None
