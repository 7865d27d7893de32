# SPDX-License-Identifier: Apache-2.0
"""The blocks of rtl/ in the designs of others: what a module is made of, its FuseSoC core, its
LiteX and Amaranth instances, and the examples of docs/embedding.md.
"""
