# SPDX-License-Identifier: Apache-2.0
"""What is closed at the end of a `with` block."""

import abc
from types import TracebackType
from typing import Self


class Closing(abc.ABC):
    """Has a method close(), which the end of its `with` block calls."""

    @abc.abstractmethod
    def close(self) -> None:
        """Releases what it holds; it cannot be used any more."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
