# SPDX-License-Identifier: Apache-2.0
"""Yosys's command line, which its Python package lacks.

python tools/yosys.py [-q] [-l LOG] -p "command; command"        -q shows warnings and errors only
"""
import argparse

from pyosys import libyosys


def main():
    parser = argparse.ArgumentParser(prog="yosys", description="Yosys, from the package pyosys")
    parser.add_argument("-q", "--quiet", action="store_true", help="show warnings and errors only")
    parser.add_argument("-l", "--log", help="write everything into this file")
    parser.add_argument("-p", "--passes", action="append", required=True, help="commands, with ; between them")
    options = parser.parse_args()
    design = libyosys.Design()
    tee = ("tee -q " if options.quiet else "tee ") + (f"-a {options.log} " if options.log else "")
    for command in (c.strip() for passes in options.passes for c in passes.split(";")):
        if command:
            design.run_pass(tee + command if tee != "tee " else command)


if __name__ == "__main__":
    main()
