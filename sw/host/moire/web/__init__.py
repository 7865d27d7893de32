# SPDX-License-Identifier: Apache-2.0
"""The doors of `moire serve` and `moire twin` for HTTP and WebSocket. docs/clients.md says what
they offer; api.py has the table of what can be asked.

Only moire.cli.doors loads this package, so that no other command waits for it.
"""
