# SPDX-License-Identifier: Apache-2.0
"""FuseSoC generator: makes a core of Verilog sources out of an installed Python package.

Parameters: `package`, the name under which Python imports it, and `files`, paths inside it. FuseSoC
calls it as `python_package.py INPUT.yml`; the soft cores come this way, as they are never copied
into the project.
"""

import json
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import yaml


def main() -> None:
    request = yaml.safe_load(Path(sys.argv[1]).read_text(encoding="utf-8"))
    name, files = request["parameters"]["package"], request["parameters"]["files"]
    spec = find_spec(name)
    if not spec or not spec.submodule_search_locations:
        sys.exit(f"python_package: the Python package {name} is not installed: pip install {name}")
    for file in files:
        source = Path(spec.submodule_search_locations[0]) / file
        if not source.exists():
            sys.exit(f"python_package: there is no {file} in the Python package {name}")
        shutil.copy(source, Path(file).name)
    core = {
        "name": request["vlnv"],
        "filesets": {
            "rtl": {"files": [Path(file).name for file in files], "file_type": "verilogSource"}
        },
        "targets": {"default": {"filesets": ["rtl"]}},
    }
    Path(f"{name}.core").write_text("CAPI=2:\n" + json.dumps(core, indent=2) + "\n")


if __name__ == "__main__":
    main()
