# SPDX-License-Identifier: Apache-2.0
"""Models and the harness are imported by name."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from bench import model_path  # noqa: E402  (found through the line above)

model_path()
