# SPDX-License-Identifier: Apache-2.0
"""How bytes reach the nodes: protocol, transports, gateway, and recordings of the bus."""
