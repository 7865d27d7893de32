# SPDX-License-Identifier: Apache-2.0
"""The controllers as a program sees them: buses, nodes, axes, and the services of a node.

`bus`, `node` and `axis` hold the classes that every program needs; `records` holds what they
return. `job`, `indexing_table`, `settings` and `nonvolatile` serve a node with the firmware image
`station`, `segments` the scale-error table of an axis, `relay` the encoder relay of S1.
"""
